//! Meshes whose vertices move: as the same mesh does under a transform that moves, where it can; else against closed forms.

use math::{Dir, Point, Ray, Vec3};
use render::SceneOptions;
use scene_desc::Sink;
use steradian_tests::{Eye, Family, Way, compile, workers};

const WALKS: [Way<'_>; 4] = [
    Way { integrator: "path", settings: &[] },
    Way { integrator: "recursive", settings: &[] },
    Way { integrator: "bdpt", settings: &[] },
    Way { integrator: "direct", settings: &[] },
];

const HEAD: &str = "TransformTimes 0.2 0.9\nCamera \"perspective\"\nWorldBegin\n\
    Material \"diffuse\" \"rgb reflectance\" [0.5 0.5 0.5]\n";

/// Two bent triangles with normals and texture coordinates, each point and normal mapped; `more` goes to the shape.
fn bent(p: impl Fn(Vec3) -> Vec3, more: &str) -> String {
    let numbers = |points: [Vec3; 4]| points.map(|v| format!("{} {} {}", v.x, v.y, v.z)).join(" ");
    let corners = [[-1.0, -1.0, 0.0], [1.0, -0.8, 0.3], [0.9, 1.1, -0.2], [-0.8, 0.9, 0.4]].map(Vec3::from);
    let normals = [[-0.3, 0.1, 1.0], [0.4, 0.0, 1.0], [0.1, 0.5, 1.0], [-0.2, -0.3, 1.0]].map(Vec3::from);
    format!(
        "Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point3 P\" [ {} ]\n\"normal N\" [ {} ] {}\n\
         \"point2 uv\" [ 0 0 1 0.1 0.9 1 0.1 0.8 ]\n",
        numbers(corners),
        numbers(normals),
        if more.is_empty() {
            String::new()
        } else {
            format!("\"point3 {more}\" [ {} ]", numbers(corners.map(p)))
        }
    )
}

/// Growing and shifting are linear in every vertex: rays at all moments meet the same points, with the same tangents and normals,
/// in the world and in an instance that is turned and mirrored.
#[test]
fn vertices_go_where_a_transform_leads() {
    let by_transform =
        "ActiveTransform EndTime\nTranslate 0.4 -0.3 0.6\nScale 1.5 1.5 1.5\nActiveTransform All\n";
    let by_vertices = bent(|p| p * 1.5 + Vec3::new(0.4, -0.3, 0.6), "P1");
    let turn = "Rotate 50 0.2 1 0.4\nScale -1 1 1\n";
    let in_object = format!("ObjectBegin \"it\"\n{by_vertices}ObjectEnd\n{turn}ObjectInstance \"it\"\n");
    for (reference, moving) in [
        (format!("{by_transform}{}", bent(|p| p, "")), by_vertices),
        (format!("{turn}{by_transform}{}", bent(|p| p, "")), in_object),
    ] {
        let [a, b] =
            [reference, moving].map(|world| compile(&format!("{HEAD}{world}"), &SceneOptions::default()));
        assert!(a.has_moving_shapes() && b.has_moving_shapes());
        let (mut met, mut differ) = (0, 0);
        for i in 0..4000_u16 {
            // Points of a lattice, from two sides, at moments before, between and after the keys.
            let [x, y, time] = [0.754_877_7, 0.569_840_3, 0.618_034].map(|g| (f32::from(i) * g).fract());
            let target = Vec3::new(3.6 * x - 1.8, 3.6 * y - 1.8, 0.0);
            let from = Vec3::new(0.3, -0.2, if i % 2 == 0 { 6.0 } else { -6.0 });
            let ray = Ray::new(Point(from), Dir::normalize(target - from), time);
            match (a.intersect(&ray), b.intersect(&ray)) {
                (Some(hit_a), Some(hit_b)) => {
                    met += 1;
                    let (si, sj) = (a.interaction(&ray, &hit_a), b.interaction(&ray, &hit_b));
                    let pairs = [
                        (si.p.0, sj.p.0),
                        (si.ng.0, sj.ng.0),
                        (si.frame.n.0, sj.frame.n.0),
                        (si.dpdu, sj.dpdu),
                        (si.dpdv, sj.dpdv),
                        (si.uv.extend(0.0), sj.uv.extend(0.0)),
                    ];
                    for (n, (v, w)) in pairs.into_iter().enumerate() {
                        assert!((v - w).length() < 2e-5, "{n} at {time}: {v} {w}");
                    }
                }
                (None, None) => {}
                // By the edge.
                (Some(_), None) | (None, Some(_)) => differ += 1,
            }
        }
        assert!(met > 1000 && differ <= 2, "{met} met, {differ} by one alone");
    }
}

/// A black sheet draws its left edge back at a pace of its own, and bares the sky in the middle halfway between the keys.
#[test]
fn an_edge_that_passes_covers_for_its_share_of_time() {
    let world = "LightSource \"infinite\" \"rgb L\" [1 1 1]\nMaterial \"diffuse\" \"rgb reflectance\" [0 0 0]\n\
        Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point3 P\" [-1 -1 0 1 -1 0 1 1 0 -1 1 0]\n\
        \"point3 P1\" [1 -1 0 1 -1 0 1 1 0 1 1 0]\n";
    let mut family = Family::default();
    for (times, truth) in [("0 1", 0.5), ("0.5 1", 0.25), ("-1 0.9", 1.0), ("0.2 0.6", 0.6)] {
        let head = Eye::at([0.0, 0.0, 2.0], [0.0; 3], 128).head();
        let head = head.replace("WorldBegin", &format!("TransformTimes {times}\nWorldBegin"));
        let scene = compile(&format!("{head}{world}"), &SceneOptions::default());
        for (i, way) in WALKS.iter().enumerate() {
            let found = way.moments(&scene, 50 + i as u64);
            family.mean(format!("keys at {times}, {}", way.name()), &found, truth);
        }
    }
    family.finish();
}

/// What vertices that move cannot do is said, once.
#[test]
fn what_cannot_move_is_told() {
    let bent = bent(|p| p + Vec3::Z, "P1");
    let world = format!(
        "AreaLightSource \"diffuse\"\n{bent}ObjectBegin \"it\"\n{bent}ObjectEnd\nObjectInstance \"it\"\nObjectInstance \"it\"\n"
    );
    let file = tempfile::Builder::new().suffix(".pbrt").tempfile().unwrap();
    std::fs::write(file.path(), format!("{HEAD}{world}")).unwrap();
    let mut sink = Sink::default();
    let scene = render::open(file.path(), &SceneOptions::default(), &workers(1), &mut sink).unwrap().scene;
    assert_eq!(scene.lights.len(), 0);
    let told = sink.diagnostics().iter().filter(|d| d.message == "a mesh whose vertices move cannot emit");
    assert_eq!(told.count(), 2, "{}", sink.render());
}

/// A sheet through the origin tilts: at `t` it lies at z = 2 t x. Under light along z it shows the mean cosine of its normal: that of
/// the triangle, of tangent 2 t, or that told at the vertices, on the chord between unit vectors with the angle 2 a = atan 2.
#[test]
fn a_sheet_that_tilts_shows_the_mean_cosine() {
    let mut family = Family::default();
    let n = "\"normal N\" [0 0 1 0 0 1 0 0 1] \"normal N1\" [-2 0 1 -2 0 1 -2 0 1]";
    let flat = libm::asinh(2.0) / 2.0;
    let (sin, cos) = libm::sincos(libm::atan(2.0) / 2.0);
    let smooth = cos * cos / sin * libm::asinh(sin / cos);
    for (name, normals, cosine) in [("flat", "", flat), ("with normals", n, smooth)] {
        let world = format!(
            "LightSource \"distant\" \"point3 from\" [0 0 1] \"point3 to\" [0 0 0] \"rgb L\" [3.14159265 3.14159265 3.14159265]\n\
             Material \"diffuse\" \"rgb reflectance\" [0.5 0.5 0.5]\n\
             Shape \"trianglemesh\" \"point3 P\" [-1 -1 0 1 -1 0 0 1 0] \"point3 P1\" [-1 -1 -2 1 -1 2 0 1 0] {normals}\n"
        );
        let scene = Eye::on_floor(64).scene(&world);
        for (i, way) in WALKS.iter().enumerate() {
            family.mean(format!("{name}, {}", way.name()), &way.moments(&scene, 40 + i as u64), 0.5 * cosine);
        }
    }
    family.finish();
}
