//! What directives mean: pbrt-v4's rules, each on a scene of a few lines.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    clippy::wildcard_enum_match_arm,
    clippy::too_many_lines,
    reason = "tests"
)]

mod common;

use common::{Folder, load, world};
use math::{Point, Vec2, Vec3};
use scene_desc::{
    ApertureDesc, CameraKind, ColorSpaceName, ConductorSpectrum, FilterDesc, FloatInput, Geometry,
    ImageEncoding, IndexOfRefraction, LightKind, LightSelection, Mapping2d, MaterialKind, MediumKind,
    ParameterValue, SpectrumDesc, SpectrumInput, TextureInput, TextureNode, WrapMode,
};

/// Options and nothing else.
fn options(text: &str) -> scene_desc::SceneDesc {
    let (scene, messages) = load(format!("{text}\nWorldBegin"));
    assert_eq!(messages, "");
    scene.unwrap()
}

/// Where the origin of shape `i` is at a time.
fn origin(scene: &scene_desc::SceneDesc, i: usize, time: f32) -> Vec3 {
    scene.shapes[i].world_from_object.at(time).point(Point::default()).0
}

#[test]
fn transforms_apply_to_what_follows_and_end_with_their_block() {
    let scene = world(
        "Translate 1 0 0\nAttributeBegin\nScale 2 2 2\nTranslate 1 0 0\nShape \"sphere\"\nAttributeEnd\n\
         Shape \"sphere\"\nRotate 90 0 0 1\nTranslate 1 0 0\nShape \"sphere\"\n\
         Identity Shape \"sphere\"\nTransform [ 1 0 0 0 0 1 0 0 0 0 1 0 5 6 7 1 ] Shape \"sphere\"\n\
         ConcatTransform [ 1 0 0 0 0 1 0 0 0 0 1 0 1 1 1 1 ] Shape \"sphere\"\n\
         TransformBegin Identity TransformEnd Shape \"sphere\"",
    );
    let expected = [
        [3.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [1.0, 1.0, 0.0],
        [0.0, 0.0, 0.0],
        [5.0, 6.0, 7.0],
        [6.0, 7.0, 8.0],
        [6.0, 7.0, 8.0],
    ];
    for (i, p) in expected.into_iter().enumerate() {
        assert!(origin(&scene, i, 0.0).distance(Vec3::from_array(p)) < 1e-6, "shape {i}");
    }
}

#[test]
fn the_camera_looks_from_where_look_at_says_and_its_space_has_a_name() {
    let text = "LookAt 0 0 -5  0 0 0  0 1 0\nCamera \"perspective\" \"float fov\" [ 40 ]\nWorldBegin\n\
         CoordSysTransform \"camera\"\nTranslate 0 0 2\nShape \"sphere\"\n\
         CoordSysTransform \"world\"\nShape \"sphere\"";
    let scene = load(text).0.unwrap();
    let eye = scene.camera.world_from_camera.at(0.0).point(Point::default());
    assert!(eye.distance(Point::new(0.0, 0.0, -5.0)) < 1e-6);
    assert!(origin(&scene, 0, 0.0).distance(Vec3::new(0.0, 0.0, -3.0)) < 1e-6);
    assert_eq!(origin(&scene, 1, 0.0), Vec3::ZERO);
    assert!(matches!(scene.camera.kind, CameraKind::Perspective { fov, focal_distance, .. }
        if fov == 40.0 && focal_distance == 1e6));
}

#[test]
fn what_moves_has_two_transforms_and_times() {
    let text = "TransformTimes 0 2\nWorldBegin\nActiveTransform EndTime\nTranslate 2 0 0\nActiveTransform All\n\
         Translate 0 1 0\nShape \"sphere\"\nActiveTransform StartTime\nTranslate 0 0 3\nShape \"sphere\"";
    let scene = load(text).0.unwrap();
    assert_eq!(origin(&scene, 0, 0.0), Vec3::new(0.0, 1.0, 0.0));
    assert!(origin(&scene, 0, 1.0).distance(Vec3::new(1.0, 1.0, 0.0)) < 1e-6);
    assert_eq!(origin(&scene, 0, 2.0), Vec3::new(2.0, 1.0, 0.0));
    assert_eq!(origin(&scene, 1, 0.0), Vec3::new(0.0, 1.0, 3.0));
}

#[test]
fn vertices_move_at_the_times_of_transforms() {
    let text = "TransformTimes 0.5 2\nWorldBegin\n\
         Shape \"trianglemesh\" \"point3 P\" [ 0 0 0 1 0 0 0 1 0 ] \"point3 P1\" [ 0 0 3 1 0 0 0 1 0 ]\n\
         \"normal N\" [ 0 0 1 0 0 1 0 0 1 ] \"normal N1\" [ 0 1 0 0 1 0 0 0 1 ]\n\
         Shape \"trianglemesh\" \"point3 P\" [ 0 0 0 1 0 0 0 1 0 ]";
    let scene = load(text).0.unwrap();
    let mesh = |i: usize| match &scene.shapes[i].geometry {
        Geometry::Mesh(mesh) => mesh,
        other => panic!("{other:?}"),
    };
    assert!(mesh(0).is_moving() && !mesh(1).is_moving());
    assert_eq!((mesh(0).end_positions[0], mesh(0).end_normals[0]), (Vec3::Z * 3.0, Vec3::Y));
    assert_eq!(mesh(0).key_times, [0.5, 2.0]);
}

#[test]
fn attributes_are_saved_and_restored() {
    let scene = world(
        "MakeNamedMaterial \"m\" \"string type\" \"dielectric\"\n\
         AttributeBegin\nReverseOrientation\nNamedMaterial \"m\"\nAreaLightSource \"diffuse\"\n\
         Shape \"sphere\"\nAttributeEnd\nShape \"sphere\"\n\
         AreaLightSource \"diffuse\" \"rgb L\" [ 1 2 3 ] \"float scale\" 2 \"bool twosided\" true\n\
         Shape \"disk\"\nAreaLightSource \"\"\nShape \"disk\"",
    );
    let shapes = &scene.shapes;
    assert!(shapes[0].reverse_orientation && !shapes[1].reverse_orientation);
    assert!(matches!(scene.materials[shapes[0].material.index()].kind, MaterialKind::Dielectric { .. }));
    assert_eq!(scene.materials[shapes[1].material.index()].kind, MaterialKind::default_diffuse());
    let light = shapes[0].area_light.as_ref().unwrap();
    assert_eq!(light.radiance.spectrum, SpectrumDesc::srgb([1.0; 3]));
    assert!(shapes[1].area_light.is_none() && shapes[3].area_light.is_none());
    let light = shapes[2].area_light.as_ref().unwrap();
    assert!(light.two_sided && light.radiance.scale == 2.0 && light.radiance.normalize);
}

#[test]
fn attribute_gives_defaults_that_parameters_overrule() {
    let scene = world(
        "ColorSpace \"rec2020\"\nAttribute \"shape\" \"float radius\" 3\n\
         Attribute \"material\" \"rgb reflectance\" [ 1 0 0 ]\nAttribute \"light\" \"float scale\" 7\n\
         ColorSpace \"srgb\"\n\
         Shape \"sphere\"\nShape \"sphere\" \"float radius\" 2\nShape \"cylinder\"\n\
         Material \"diffuse\" Shape \"sphere\" LightSource \"point\"",
    );
    let radius = |i: usize| match scene.shapes[i].geometry {
        Geometry::Sphere { radius, z_min, .. } => {
            assert_eq!(z_min, -radius);
            radius
        }
        Geometry::Cylinder { radius, .. } => radius,
        _ => 0.0,
    };
    assert_eq!([radius(0), radius(1), radius(2)], [3.0, 2.0, 3.0]);
    let kind = &scene.materials[scene.shapes[3].material.index()].kind;
    let expected = SpectrumDesc::Rgb { rgb: [1.0, 0.0, 0.0], space: ColorSpaceName::Rec2020 };
    assert_eq!(*kind, MaterialKind::Diffuse { reflectance: expected.into() });
    assert!(matches!(&scene.lights[0].kind, LightKind::Point { intensity, .. } if intensity.scale == 7.0));
}

#[test]
fn objects_keep_their_own_space_and_instances_add_theirs() {
    let scene = world(
        "Translate 1 0 0\nObjectBegin \"o\"\nTranslate 0 1 0\nShape \"sphere\"\nShape \"disk\"\nObjectEnd\n\
         Shape \"sphere\"\nTranslate 0 0 1\nObjectInstance \"o\"\nObjectInstance \"later\"\n\
         ObjectBegin \"later\" Shape \"disk\" ObjectEnd",
    );
    assert_eq!((scene.objects.len(), scene.objects[0].shapes.len(), scene.shapes.len()), (2, 2, 1));
    let inner = scene.objects[0].shapes[0].world_from_object.at(0.0).point(Point::default());
    assert_eq!(inner.0, Vec3::new(1.0, 1.0, 0.0));
    assert_eq!(origin(&scene, 0, 0.0), Vec3::new(1.0, 0.0, 0.0));
    let at = scene.instances[0].world_from_object.at(0.0).point(Point::default());
    assert_eq!(at.0, Vec3::new(1.0, 0.0, 1.0));
    assert_eq!(scene.instances[1].object.index(), 1);
}

#[test]
fn include_changes_the_state_and_import_does_not() {
    use std::io::Write;
    let mut gz = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    gz.write_all(b"Translate 0 0 1\nShape \"sphere\"\nMakeNamedMaterial \"n\" \"string type\" \"diffuse\"")
        .unwrap();
    let folder = Folder::new()
        .with("a.pbrt", "WorldBegin Include \"b.pbrt\" Shape \"sphere\"\nImport \"c.pbrt.gz\" Shape \"sphere\" NamedMaterial \"n\" Shape \"disk\"")
        .with("b.pbrt", "Translate 1 0 0")
        .with("c.pbrt.gz", gz.finish().unwrap());
    let (scene, messages) = folder.load("a.pbrt");
    assert_eq!(messages, "");
    let scene = scene.unwrap();
    let xs: Vec<_> = (0..4).map(|i| origin(&scene, i, 0.0).to_array()).collect();
    assert_eq!(xs, [[1.0, 0.0, 0.0], [1.0, 0.0, 1.0], [1.0, 0.0, 0.0], [1.0, 0.0, 0.0]]);
    assert_eq!(scene.sources.files().count(), 3);
}

#[test]
fn options_have_pbrts_defaults() {
    let scene = options("");
    assert_eq!((scene.film.resolution, scene.sampler.spp), ([1280, 720], 16));
    assert_eq!(scene.integrator.max_depth, Some(5));
    assert_eq!(scene.filter, FilterDesc::Gaussian { radius: [1.5; 2], sigma: 0.5 });
    let filter = |text: &str| options(&format!("PixelFilter \"{text}\"")).filter;
    assert_eq!(filter("box"), FilterDesc::Box { radius: [0.5; 2] });
    assert_eq!(filter("triangle"), FilterDesc::Triangle { radius: [2.0; 2] });
    let third = 1.0 / 3.0;
    assert_eq!(filter("mitchell"), FilterDesc::Mitchell { radius: [2.0; 2], b: third, c: third });
    assert_eq!(filter("sinc"), FilterDesc::Sinc { radius: [4.0; 2], tau: 3.0 });
}

#[test]
fn film_and_camera_options_are_read() {
    let scene = options(
        "Film \"rgb\" \"integer xresolution\" 100 \"integer yresolution\" [ 50 ] \"float cropwindow\" [ 0.1 0.55 0 1 ]\n\
         \"float iso\" 200 \"string filename\" \"x.exr\" \"bool savefp16\" false \"float diagonal\" 24\n\
         Camera \"orthographic\" \"float screenwindow\" [ -2 2 -1 1 ] \"float shutteropen\" 0.25 \"float shutterclose\" 0.75\n\
         Sampler \"stratified\" \"integer xsamples\" 3 \"integer ysamples\" 5\nOption \"seed\" 9\n\
         Integrator \"ambientocclusion\" \"float maxdistance\" 2 \"bool cossample\" false",
    );
    assert_eq!(scene.film.pixel_bounds, Some([10, 55, 0, 50]));
    assert_eq!(scene.film.sensor.imaging_ratio(), 1.0);
    assert_eq!(scene.camera.screen_window, Some([-2.0, 2.0, -1.0, 1.0]));
    assert_eq!((scene.sampler.spp, scene.sampler.strata, scene.sampler.seed), (15, [3, 5], 9));
    assert_eq!((scene.integrator.name.as_str(), scene.integrator.max_depth), ("ao", None));
    assert_eq!(scene.integrator.parameters["distance"], ParameterValue::Float(2.0));
    assert_eq!(scene.integrator.parameters["sampling"], ParameterValue::Text("uniform".into()));
    for (theirs, ours) in [
        ("volpath", "path"),
        ("simplepath", "path"),
        ("bdpt", "bdpt"),
        ("mlt", "mlt"),
        ("sppm", "sppm"),
        ("lightpath", "light"),
        ("randomwalk", "path"),
        ("simplevolpath", "path"),
    ] {
        let scene = options(&format!(
            "Integrator \"{theirs}\" \"integer maxdepth\" 7 \"string lightsampler\" \"power\""
        ));
        assert_eq!((scene.integrator.name.as_str(), scene.integrator.max_depth), (ours, Some(7)));
        assert_eq!(scene.integrator.light_selection, LightSelection::Power);
    }
    for theirs in ["halton", "paddedsobol", "pmj02bn", "sobol", "zsobol"] {
        let scene = options(&format!("Sampler \"{theirs}\" \"integer pixelsamples\" 4 \"integer seed\" 3"));
        assert_eq!((scene.sampler.name.as_str(), scene.sampler.spp, scene.sampler.seed), ("sobol", 4, 3));
    }
    let pixels = options("Film \"rgb\" \"integer pixelbounds\" [ -5 10 20 30 ]").film.pixel_bounds;
    assert_eq!(pixels, Some([0, 10, 20, 30]));
}

#[test]
fn materials_have_pbrts_defaults() {
    let kind = |text: &str| world(&format!("Material {text}")).materials[1].kind.clone();
    let copper = |part: &str| SpectrumInput::Constant(SpectrumDesc::Named(format!("metal-Cu-{part}")));
    assert!(
        matches!(kind("\"conductor\""), MaterialKind::Conductor { spectrum: ConductorSpectrum::EtaK { eta, k }, roughness, .. }
        if eta == copper("eta") && k == copper("k") && roughness.u == FloatInput::Constant(0.0) && roughness.remap)
    );
    assert!(matches!(
        kind("\"conductor\" \"rgb reflectance\" [ 0.5 0.5 0.5 ]"),
        MaterialKind::Conductor { spectrum: ConductorSpectrum::Reflectance(_), .. }
    ));
    assert!(matches!(kind("\"dielectric\" \"float roughness\" 0.3 \"float vroughness\" 0.1"),
        MaterialKind::Dielectric { eta: IndexOfRefraction::Constant(e), roughness, .. }
        if e == 1.5 && roughness.u == FloatInput::Constant(0.3) && roughness.v == FloatInput::Constant(0.1)));
    assert!(matches!(kind("\"thindielectric\" \"spectrum eta\" \"glass-BK7\""),
        MaterialKind::ThinDielectric { eta: IndexOfRefraction::Spectrum(SpectrumDesc::Named(n)), .. } if n == "glass-BK7"));
    assert!(
        matches!(kind("\"coateddiffuse\""), MaterialKind::CoatedDiffuse { thickness, max_depth, n_samples, .. }
        if thickness == FloatInput::Constant(0.01) && max_depth == 10 && n_samples == 1)
    );
    assert!(
        matches!(kind("\"coatedconductor\" \"float interface.roughness\" 0.2 \"rgb conductor.k\" [ 1 2 3 ] \"spectrum conductor.eta\" \"metal-Au-eta\""),
        MaterialKind::CoatedConductor { interface_roughness, conductor_roughness, .. }
        if interface_roughness.v == FloatInput::Constant(0.2) && conductor_roughness.v == FloatInput::Constant(0.0))
    );
    assert!(
        matches!(kind("\"diffusetransmission\""), MaterialKind::DiffuseTransmission { scale, .. } if scale == 1.0)
    );
    assert_eq!(kind("\"interface\""), MaterialKind::Interface);
    assert_eq!(kind("\"\""), MaterialKind::Interface);
}

#[test]
fn names_may_be_defined_after_their_use() {
    let scene = world(
        "NamedMaterial \"m\" Shape \"sphere\" \"texture alpha\" \"a\"\nMediumInterface \"\" \"\"\n\
         MakeNamedMaterial \"m\" \"string type\" \"mix\" \"string materials\" [ \"x\" \"y\" ] \"texture amount\" \"a\"\n\
         Texture \"a\" \"float\" \"scale\" \"texture tex\" \"b\" \"float scale\" 0.5\n\
         Texture \"c\" \"spectrum\" \"constant\""
            .replace("MakeNamedMaterial \"m\"", "MakeNamedMaterial \"x\" \"string type\" \"diffuse\"\nMakeNamedMaterial \"y\" \"string type\" \"diffuse\"\nMakeNamedMaterial \"m\"")
            .replace("Texture \"a\"", "Texture \"b\" \"float\" \"constant\" \"float value\" 0.5\nTexture \"a\"")
            .as_str(),
    );
    assert!(matches!(&scene.materials[scene.shapes[0].material.index()].kind,
        MaterialKind::Mix { materials, .. } if materials[0].index() == 1 && materials[1].index() == 2));
    let Some(FloatInput::Texture(alpha)) = scene.shapes[0].alpha else { panic!("no alpha texture") };
    assert!(matches!(&scene.textures[alpha.index()].node,
        TextureNode::Scale { tex: TextureInput::Texture(b), scale: FloatInput::Constant(s) }
        if b.index() < alpha.index() && *s == 0.5));
}

#[test]
fn textures_have_pbrts_defaults_and_operands() {
    let folder = Folder::new().with("i.png", "x").with("i.jpg", "x").with(
        "a.pbrt",
        "WorldBegin\nTranslate 1 2 3\n\
         Texture \"1\" \"spectrum\" \"imagemap\" \"string filename\" \"i.png\" \"string encoding\" \"linear\"\n\
         Texture \"2\" \"float\" \"imagemap\" \"string filename\" \"i.jpg\" \"string encoding\" \"linear\" \"string wrap\" \"clamp\"\n\
         Texture \"3\" \"spectrum\" \"checkerboard\" \"texture tex1\" \"1\" \"rgb tex2\" [ 1 2 3 ] \"integer dimension\" 3\n\
         Texture \"4\" \"float\" \"bilerp\" \"float v01\" 0.25\n\
         Texture \"5\" \"spectrum\" \"marble\"\n\
         Texture \"6\" \"float\" \"dots\" \"string mapping\" \"planar\" \"vector3 v1\" [ 0 0 1 ] \"float udelta\" 4\n\
         Texture \"7\" \"float\" \"directionmix\" \"vector3 dir\" [ 0 0 2 ]\n\
         Texture \"8\" \"float\" \"mix\" Texture \"9\" \"float\" \"fbm\" Texture \"10\" \"float\" \"wrinkled\" \"integer octaves\" 3\n\
         Texture \"11\" \"float\" \"windy\" Texture \"12\" \"spectrum\" \"constant\" \"blackbody value\" 3000\n\
         Texture \"13\" \"float\" \"checkerboard\" \"float uscale\" 8",
    );
    let (scene, messages) = folder.load("a.pbrt");
    assert_eq!(messages, "");
    let scene = scene.unwrap();
    let node = |name: &str| &scene.textures.iter().find(|t| t.name == name).unwrap().node;
    // pbrt heeds an encoding for PNG alone.
    assert_eq!(scene.images[0].encoding, ImageEncoding::Linear);
    assert_eq!(scene.images[1].encoding, ImageEncoding::Auto);
    assert!(
        matches!(node("2"), TextureNode::ImageMap { wrap: [WrapMode::Clamp, _], scale, invert: false, max_anisotropy, .. }
        if *scale == 1.0 && *max_anisotropy == 8.0)
    );
    let TextureNode::Checkerboard { mapping: None, texture_from_world, a: TextureInput::Texture(_), .. } =
        node("3")
    else {
        panic!("no checkerboard in 3D")
    };
    assert_eq!(texture_from_world.point(Point::new(1.0, 2.0, 3.0)), Point::default());
    assert!(matches!(node("4"), TextureNode::Bilerp { corners, .. }
        if *corners == [0.0, 0.25, 0.0, 1.0].map(TextureInput::Float)));
    assert!(matches!(node("5"), TextureNode::Marble { octaves: 8, variation, .. } if *variation == 0.2));
    assert!(matches!(node("6"), TextureNode::Dots { mapping: Mapping2d::Planar { vs, vt, shift, .. }, .. }
        if *vs == Vec3::Z && *vt == Vec3::Y && *shift == [4.0, 0.0]));
    assert!(matches!(node("7"), TextureNode::DirectionMix { dir, .. } if *dir == Vec3::Z));
    assert!(matches!(node("12"), TextureNode::Constant(TextureInput::Spectrum(SpectrumDesc::Blackbody(_)))));
    assert!(
        matches!(node("13"), TextureNode::Checkerboard { mapping: Some(Mapping2d::Uv { scale, .. }), .. }
        if *scale == [8.0, 1.0])
    );
}

#[test]
fn lights_are_read_with_their_sizes() {
    let folder = Folder::new().with("sky.exr", "x").with(
        "a.pbrt",
        "WorldBegin\nLightSource \"point\" \"spectrum I\" [ 400 1 700 2 ] \"point3 from\" [ 1 2 3 ] \"float power\" 100\n\
         LightSource \"spot\" \"blackbody I\" 5000 \"float coneangle\" 20\n\
         LightSource \"distant\" \"rgb L\" [ 2 2 2 ] \"float illuminance\" 5\n\
         LightSource \"infinite\"\nLightSource \"infinite\" \"string filename\" \"sky.exr\" \"float scale\" 3 \"point3 portal\" [ 0 0 0 1 0 0 1 1 0 0 1 0 ]\n\
         LightSource \"projection\" \"string filename\" \"sky.exr\"\nLightSource \"goniometric\" \"string filename\" \"sky.exr\"",
    );
    let (scene, messages) = folder.load("a.pbrt");
    assert_eq!(messages, "");
    let scene = scene.unwrap();
    let kinds: Vec<_> = scene.lights.iter().map(|l| &l.kind).collect();
    assert!(matches!(kinds[0], LightKind::Point { intensity, from, power: Some(p) }
        if *p == 100.0 && *from == Vec3::new(1.0, 2.0, 3.0)
            && intensity.spectrum == SpectrumDesc::Curve(vec![(400.0, 1.0), (700.0, 2.0)].into())));
    assert!(matches!(kinds[1], LightKind::Spot { cone_angle, cone_delta, to, power: None, .. }
        if *cone_angle == 20.0 && *cone_delta == 5.0 && *to == Vec3::Z));
    assert!(matches!(kinds[2], LightKind::Distant { illuminance: Some(e), .. } if *e == 5.0));
    assert!(matches!(kinds[3], LightKind::InfiniteConstant { illuminance: None, .. }));
    assert!(matches!(kinds[4], LightKind::InfiniteImage { scale, portal: Some(_), .. } if *scale == 3.0));
    assert!(matches!(kinds[5], LightKind::Projection { fov, .. } if *fov == 90.0));
    assert!(matches!(kinds[6], LightKind::Goniometric { image: Some(_), .. }));
    assert_eq!(scene.images.len(), 1, "one file is held once");
}

#[test]
fn a_goniometric_lights_file_may_be_a_photometric_one() {
    let text = "WorldBegin\nLightSource \"goniometric\" \"string filename\" \"a.IES\" \"float scale\" 2 \"float power\" 50";
    let folder = Folder::new().with("a.IES", "TILT=NONE").with("a.pbrt", text);
    let (scene, messages) = folder.load("a.pbrt");
    assert_eq!(messages, "");
    let scene = scene.unwrap();
    assert!(matches!(&scene.lights[0].kind, LightKind::Ies { path, intensity, power: Some(50.0) }
        if path.ends_with("a.IES") && intensity.scale == 2.0));
    // What is in the file is part of what the scene is.
    let other = folder.with("a.IES", "TILT=NONE 1").load("a.pbrt").0.unwrap();
    assert_ne!(scene.content_hash, other.content_hash);
    let (none, messages) = Folder::new().with("a.pbrt", text).load("a.pbrt");
    assert!(
        none.is_none() && messages.contains("a.pbrt:2:") && messages.contains("cannot be read"),
        "{messages}"
    );
}

#[test]
fn media_have_names_on_both_sides() {
    let (scene, messages) = load(
        "WorldBegin\nMakeNamedMedium \"milk\" \"string type\" \"homogeneous\" \"string preset\" \"Wholemilk\" \"float g\" 0.5\n\
         MediumInterface \"milk\" \"\" Shape \"sphere\"\nMediumInterface \"milk\" Shape \"sphere\"\nMediumInterface \"\" \"milk\" LightSource \"point\"",
    );
    assert_eq!(messages, "");
    let scene = scene.unwrap();
    assert!(matches!(&scene.media[0].kind, MediumKind::Homogeneous { sigma_a, le: None, scale, .. }
        if *sigma_a == SpectrumDesc::srgb([0.0011, 0.0024, 0.014]) && *scale == 1.0));
    let sides = scene.shapes[0].medium_interface.unwrap();
    assert!(sides.inside.is_some() && sides.outside.is_none());
    assert!(scene.shapes[1].medium_interface.is_none(), "the same on both sides is no border");
    assert!(scene.lights[0].medium.is_some());
}

#[test]
fn meshes_keep_what_their_vertices_say() {
    let scene = world(
        "Shape \"trianglemesh\" \"point3 P\" [ 0 0 0 1 0 0 0 1 0 1 1 0 ] \"integer indices\" [ 0 1 2 2 1 3 ]\n\
         \"normal N\" [ 0 0 1 0 0 1 0 0 1 0 0 1 ] \"point2 uv\" [ 0 0 1 0 0 1 1 1 ] \"vector3 S\" [ 1 0 0 1 0 0 1 0 0 1 0 0 ] \"integer faceIndices\" [ 0 1 ] \"float alpha\" 0.5\n\
         Shape \"trianglemesh\" \"point3 P\" [ 0 0 0 1 0 0 0 1 0 ]\n\
         Shape \"bilinearmesh\" \"point3 P\" [ 0 0 0 1 0 0 0 1 0 1 1 0 ]\n\
         Shape \"loopsubdiv\" \"point3 P\" [ 0 0 0 1 0 0 0 1 0 ] \"integer indices\" [ 0 1 2 ] \"integer levels\" 2\n\
         Shape \"curve\" \"point3 P\" [ 0 0 0 1 0 0 2 0 0 3 0 0 4 0 0 5 0 0 6 0 0 ] \"float width\" 0.1 \"float width1\" 0.2",
    );
    let Geometry::Mesh(m) = &scene.shapes[0].geometry else { panic!("no mesh") };
    assert_eq!((m.indices.as_slice(), m.normals.len(), m.uvs[3].x), (&[[0, 1, 2], [2, 1, 3]][..], 4, 1.0));
    assert_eq!(m.tangents[0], Vec3::X);
    assert_eq!(scene.shapes[0].alpha, Some(FloatInput::Constant(0.5)));
    let Geometry::Mesh(m) = &scene.shapes[1].geometry else { panic!("no mesh") };
    assert_eq!(m.indices, [[0, 1, 2]]);
    let Geometry::BilinearMesh(m) = &scene.shapes[2].geometry else { panic!("no patch") };
    assert_eq!(m.indices, [[0, 1, 2, 3]]);
    assert!(matches!(&scene.shapes[3].geometry, Geometry::LoopSubdiv(l) if l.levels == 2));
    assert!(
        matches!(&scene.shapes[4].geometry, Geometry::Curve(c) if c.segments.len() == 2 && c.width == [0.1, 0.2])
    );
}

#[test]
fn spheres_and_disks_are_cut_as_pbrt_cuts_them() {
    let scene = world(
        "Shape \"sphere\" \"float radius\" 2 \"float zmin\" 9 \"float zmax\" -1 \"float phimax\" 400\nShape \"disk\" \"float height\" 3",
    );
    assert!(matches!(scene.shapes[0].geometry, Geometry::Sphere { radius, z_min, z_max, phi_max }
        if radius == 2.0 && z_min == -1.0 && z_max == 2.0 && phi_max == 360.0));
    assert!(matches!(scene.shapes[1].geometry, Geometry::Disk { height, radius, inner_radius, .. }
        if height == 3.0 && radius == 1.0 && inner_radius == 0.0));
}

#[test]
fn spectra_come_from_files() {
    let text = "WorldBegin Material \"conductor\" \"spectrum eta\" \"a.spd\" \"spectrum k\" \"b.spd\"";
    let folder = Folder::new().with("a.pbrt", text).with("a.spd", "# λ n\n400 1.5\n700 1.6 # end\n");
    let (scene, messages) = folder.with("b.spd", "400 1 700 2").load("a.pbrt");
    assert_eq!(messages, "");
    let kind = scene.unwrap().materials[1].kind.clone();
    let curve = |v: Vec<(f32, f32)>| SpectrumInput::Constant(SpectrumDesc::Curve(v.into()));
    assert!(matches!(kind, MaterialKind::Conductor { spectrum: ConductorSpectrum::EtaK { eta, k }, .. }
        if eta == curve(vec![(400.0, 1.5), (700.0, 1.6)]) && k == curve(vec![(400.0, 1.0), (700.0, 2.0)])));
    for (text, said) in [
        ("400 1 400 2", "does not come after"),
        ("400", "no pairs"),
        ("400 x", "is no number"),
        ("", "without values"),
    ] {
        let folder =
            Folder::new().with("a.pbrt", "WorldBegin Material \"conductor\" \"spectrum k\" \"b.spd\"");
        let messages = folder.with("b.spd", text).load("a.pbrt").1;
        assert!(messages.contains(said), "{messages}");
    }
}

#[test]
fn the_content_hash_sees_every_file_and_no_path() {
    let scene = "WorldBegin Shape \"plymesh\" \"string filename\" \"m.ply\" Texture \"t\" \"float\" \"imagemap\" \"string filename\" \"i.png\"";
    let ply = |x: u32| {
        format!(
            "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0 1 0 0 0 {x} 0 3 0 1 2\n"
        )
    };
    let hash = |scene: &str, x: u32, image: &str| {
        let folder = Folder::new().with("a.pbrt", scene).with("m.ply", ply(x)).with("i.png", image);
        let (scene, messages) = folder.load("a.pbrt");
        assert_eq!(messages, "");
        scene.unwrap().content_hash
    };
    let first = hash(scene, 1, "x");
    assert_eq!(first, hash(scene, 1, "x"));
    assert_ne!(first, hash(scene, 2, "x"));
    assert_ne!(first, hash(scene, 1, "y"));
    assert_ne!(first, hash(&format!("{scene} "), 1, "x"));
}

#[test]
fn openings_of_lenses_have_shapes() {
    let read = |camera: &str| {
        let text = format!("Camera {camera}\nWorldBegin\nShape \"sphere\"\n");
        let folder = Folder::new().with("l.dat", "50 2 1.5 20\n-50 1 1 20\n0 45 0 8\n").with("a.pfm", "x");
        let (scene, messages) = folder.with("a.pbrt", &text).load("a.pbrt");
        let shape = scene.map(|s| match s.camera.kind {
            CameraKind::Perspective { aperture, .. } => aperture,
            CameraKind::Realistic(stack) => stack.aperture,
            CameraKind::Orthographic { .. } | CameraKind::Spherical { .. } => panic!("{camera}"),
        });
        (shape, messages)
    };
    let corners = |camera: &str| match read(camera) {
        (Some(ApertureDesc::Polygon(corners)), messages) if messages.is_empty() => corners,
        other => panic!("{camera}: {other:?}"),
    };
    let hexagon =
        corners("\"perspective\" \"float lensradius\" 0.1 \"integer blades\" 6 \"float rotation\" 90");
    assert!(hexagon.len() == 6 && (hexagon[0] + Vec2::X).length() < 1e-6, "{hexagon:?}");
    let lens = "\"realistic\" \"string lensfile\" \"l.dat\" \"string aperture\"";
    assert_eq!(corners(&format!("{lens} \"square\"")).len(), 4);
    let pentagon = corners(&format!("{lens} \"pentagon\""));
    assert!(pentagon.len() == 5 && (pentagon[0] - Vec2::new(0.0, -0.8)).length() < 1e-6, "{pentagon:?}");
    assert_eq!(corners(&format!("{lens} \"star\"")).len(), 10);
    assert!(
        matches!(read(&format!("{lens} \"gaussian\"")), (Some(ApertureDesc::Gaussian), m) if m.is_empty())
    );
    assert!(matches!(read(&format!("{lens} \"circular\"")), (Some(ApertureDesc::Disk), m) if m.is_empty()));
    assert!(matches!(read(&format!("{lens} \"a.pfm\"")), (Some(ApertureDesc::Image(_)), m) if m.is_empty()));
    let (none, messages) = read(&format!("{lens} \"heart\""));
    assert!(none.is_none() && messages.contains("a.pbrt:1:") && messages.contains("heart cannot be read"));
    let (none, messages) = read("\"perspective\" \"integer blades\" 2");
    assert!(none.is_none() && messages.contains("2 blades"), "{messages}");
}

#[test]
fn a_realistic_camera_has_the_lenses_of_its_file() {
    let text = "Camera \"realistic\" \"string lensfile\" \"l.dat\" \"float aperturediameter\" 4 \"float focusdistance\" 2\n\
         Film \"rgb\" \"float diagonal\" 24\nWorldBegin\nShape \"sphere\"\n";
    let folder = common::Folder::new().with("a.pbrt", text);
    let lens = "# radius thickness eta diameter\n50 2 1.5 20\n-50 1 1 20 # rear\n0 45 0 8\n";
    let (scene, messages) = folder.with("l.dat", lens).load("a.pbrt");
    assert_eq!(messages, "");
    let CameraKind::Realistic(stack) = scene.unwrap().camera.kind else { panic!() };
    let last = stack.elements[2];
    assert_eq!((stack.elements.len(), last.curvature, last.thickness, last.aperture), (3, 0.0, 45.0, 8.0));
    assert_eq!((stack.aperture_diameter, stack.focus_distance, stack.diagonal_mm), (4.0, 2.0, 24.0));
    let folder = common::Folder::new().with("a.pbrt", text);
    let (scene, messages) = folder.with("l.dat", "50 2 1.5\n").load("a.pbrt");
    assert!(scene.is_none() && messages.contains("is no lens file"), "{messages}");
}
