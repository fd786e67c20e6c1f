//! What is said about broken scenes: the place, what is wrong, what to do. Each text here is one that a person reads.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    clippy::wildcard_enum_match_arm,
    clippy::too_many_lines,
    reason = "tests"
)]

mod common;

use std::time::{Duration, Instant};

use common::{Folder, complaints, load};
use insta::assert_snapshot;

#[test]
fn files_that_are_no_scene() {
    let folder = Folder::new()
        .with("empty.pbrt", "")
        .with("comment.pbrt", "# nothing here\n")
        .with(
            "junk.pbrt",
            (0..2000_u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 13) as u8).collect::<Vec<_>>(),
        )
        .with("utf16.pbrt", b"\xff\xfeW\0o\0r\0l\0d\0")
        .with("damaged.pbrt.gz", b"\x1f\x8b\x08\0\0\0\0\0\0\x03nonsense")
        .with("scene.xml", "<scene/>")
        .with("scene.gltf", "{}")
        .with("notes.txt", "hello");
    let files = ["empty.pbrt", "comment.pbrt", "junk.pbrt", "utf16.pbrt", "damaged.pbrt.gz", "absent.pbrt"];
    let others = ["scene.xml", "scene.gltf", "notes.txt", "absent.txt", "."];
    let all: Vec<_> = files.into_iter().chain(others).map(|f| folder.load(f).1).collect();
    assert_snapshot!(all.join(""), @r#"
    empty.pbrt: error: no WorldBegin: there is no scene in it
      hint: shapes and lights come after WorldBegin
    comment.pbrt: error: no WorldBegin: there is no scene in it
      hint: shapes and lights come after WorldBegin
    junk.pbrt: error: binary data, not a scene's text
      hint: expected pbrt-v4's text
    utf16.pbrt: error: UTF-16 text: only UTF-8 can be read
      hint: expected pbrt-v4's text
    damaged.pbrt.gz: error: damaged.pbrt.gz cannot be read: damaged gzip data: corrupt deflate stream
      hint: the file is truncated or damaged
    absent.pbrt: error: absent.pbrt cannot be read: No such file or directory (os error 2)
      hint: is it the right path?
    scene.xml:1:1: warning: <scene> has no version
      hint: it is read as version 3.0.0: add version="3.0.0"
    scene.xml:1:1: error: the scene has no sensor
      hint: add <sensor type="perspective"> …
    scene.gltf: error: glTF version ``: only 2.0 can be read
      hint: asset.version says it; export the scene again as glTF 2.0
    notes.txt: error: not a scene file that is known
      hint: scenes end in .pbrt, .pbrt.gz, .xml (Mitsuba), .gltf or .glb
    absent.txt: error: cannot be read: No such file or directory (os error 2)
      hint: scenes end in .pbrt, .pbrt.gz, .xml (Mitsuba), .gltf or .glb
    .: error: not a scene file that is known
      hint: scenes end in .pbrt, .pbrt.gz, .xml (Mitsuba), .gltf or .glb
    "#);
}

#[test]
fn words_that_are_no_directives() {
    assert_snapshot!(complaints("Shpae \"sphere\" \"float radius\" 1\nMaterial \"difuse\"\nXyzzy 1 2\nWorldEnd"), @r#"
    a.pbrt:2:1: error: unknown directive Shpae
      hint: did you mean Shape?
    a.pbrt:3:1: error: unknown material "difuse"
      hint: did you mean "diffuse"?
    a.pbrt:4:1: error: unknown directive Xyzzy
      hint: directives are words such as Shape or Material
    "#);
    assert_snapshot!(complaints("\"sphere\"\n] Shape \"sphere\""), @r#"
    a.pbrt:2:1: error: expected a directive, found the string "sphere"
      hint: is something missing before it?
    "#);
    assert_snapshot!(complaints("Shape sphere\nShape\n"), @r#"
    a.pbrt:2:7: error: Shape: expected a name in quotes, found sphere
      hint: write it as "name"
    a.pbrt:4:1: error: the file ends within a directive
      hint: is it complete?
    "#);
    assert_snapshot!(complaints("Shape \"spere\"\nLightSource \"pont\"\nTexture \"t\" \"floot\" \"constant\"\nTexture \"t\" \"float\" \"konstant\""), @r#"
    a.pbrt:2:1: error: unknown shape "spere"
      hint: did you mean "sphere"?
    a.pbrt:3:1: error: unknown light "pont"
      hint: did you mean "point"?
    a.pbrt:4:13: error: unknown texture kind "floot"
      hint: possible are "float" and "spectrum"
    a.pbrt:5:1: error: unknown texture type "konstant"
      hint: did you mean "constant"?
    "#);
}

#[test]
fn strings_and_lists_without_end() {
    assert_snapshot!(complaints("Shape \"sphere\n\"float radius\" [ 1 ]"), @r#"
    a.pbrt:2:7: error: unterminated string: the line ends in it
      hint: add the closing quote
    "#);
    assert_snapshot!(complaints("Shape \"sphere\" \"float radius\" [ 1 \nMaterial \"diffuse\"\nShape \"disk\" \"float radius\" [ 2"), @r#"
    a.pbrt:2:31: error: unterminated list of "radius"
      hint: add ] before a.pbrt:3:1
    a.pbrt:4:29: error: unterminated list of "radius": the file ends in it
      hint: add ] before a.pbrt:4:32
    "#);
    assert_snapshot!(complaints("Shape \"sphere\" \"float radius\" [ [ 1 ] ]"), @r#"
    a.pbrt:2:33: error: a list within a list
      hint: close the first with ]
    "#);
    assert_snapshot!(complaints("Shape \"sphere\" \"float radius\"\nShape \"disk\""), @r#"
    a.pbrt:3:1: error: "radius" has no value
      hint: add one, as in [ 1 ]
    "#);
    assert_snapshot!(complaints("Include \"a\\qb\""), @r#"
    a.pbrt:2:9: error: unknown escape in a string
      hint: \b \f \n \r \t \\ \' and \" are known; write paths with / or \\
    "#);
}

#[test]
fn parameters_of_the_wrong_kind() {
    assert_snapshot!(complaints(
        "Shape \"sphere\" \"float raduis\" 1 \"integer radius\" 1 \"flot zmin\" 1 \"radius\" 2 \"string\" \"x\"\n\
         Shape \"sphere\" \"float radius\" \"big\" \"float zmin\" [ 1 2 ] \"bool alpha\" yes \"float zmax\" [ ]\n\
         Material \"diffuse\" \"float reflectance\" 0.5\n\
         Material \"diffuse\" \"rgb reflectance\" [ 1 2 ]\n\
         Material \"diffuse\" \"rgb reflectance\" [ 1 2 3 ]\n\
         Material \"diffuse\" \"rgb reflectance\" [ -1 0 0 ]\n\
         Material \"dielectric\" \"float roughness\" 0.1 \"float uroughness\" 0.1 \"float vroughness\" 0.2"
    ), @r#"
    a.pbrt:2:16: error: "float raduis": shape "sphere" has no such parameter
      hint: did you mean "radius"?
    a.pbrt:2:33: error: "integer radius": of the wrong type for shape "sphere"
      hint: it takes "float"
    a.pbrt:2:52: error: unknown parameter type "flot"
      hint: did you mean "float"?
    a.pbrt:2:66: error: "radius" is no parameter declaration
      hint: expected a type and a name, as in "float fov"
    a.pbrt:2:77: error: "string" is no parameter declaration
      hint: expected a type and a name, as in "float fov"
    a.pbrt:3:31: error: "radius": "big" is no float
      hint: expected a number
    a.pbrt:3:37: error: "zmin" has 2 values
      hint: it takes one
    a.pbrt:3:71: error: "alpha": yes is no bool
      hint: expected true or false
    a.pbrt:3:75: error: "float zmax" has 0 values
      hint: expected at least one
    a.pbrt:4:20: error: "float reflectance": of the wrong type for material "diffuse"
      hint: it takes "rgb", "spectrum", "blackbody" and "texture"
    a.pbrt:5:20: error: "rgb reflectance" has 2 values
      hint: expected a multiple of 3
    a.pbrt:6:20: error: "rgb reflectance" [ 1 2 3 ] is above 1
      hint: a surface gives back no more than it receives: 0 to 1
    a.pbrt:7:20: error: "rgb reflectance" [ -1 0 0 ] is negative
      hint: expected values of at least 0
    "#);
}

#[test]
fn numbers_that_are_none_or_do_not_fit() {
    assert_snapshot!(complaints(
        "Shape \"sphere\" \"float radius\" nan\n\
         Shape \"sphere\" \"float radius\" inf\n\
         Shape \"sphere\" \"float radius\" 1e39\n\
         Shape \"sphere\" \"float radius\" 1.2.3\n\
         Shape \"loopsubdiv\" \"integer levels\" 99999999999\n\
         Shape \"loopsubdiv\" \"integer levels\" 1.5\n\
         Translate 1 nan 0\n\
         Translate 1 2\n\
         Shape \"sphere\" \"float radius\" -0\n\
         Scale 1e300 1 1"
    ), @r#"
    a.pbrt:2:31: error: "radius": nan is no float
      hint: expected a number
    a.pbrt:3:31: error: "radius": inf is no float
      hint: expected a number
    a.pbrt:4:31: error: "radius": 1e39 does not fit a 32-bit float
      hint: floats go up to 3.4e38
    a.pbrt:5:31: error: "radius": 1.2.3 is no float
      hint: expected a number
    a.pbrt:6:1: error: shape "loopsubdiv" has no vertices
      hint: add "point3 P" [ … ]
    a.pbrt:6:37: error: "levels": 99999999999 does not fit an integer
      hint: integers go from -2147483648 to 2147483647
    a.pbrt:7:1: error: shape "loopsubdiv" has no vertices
      hint: add "point3 P" [ … ]
    a.pbrt:7:37: error: "levels": 1.5 is no integer
      hint: expected a whole number
    a.pbrt:8:13: error: Translate: number 2 of 3: nan is no number
      hint: expected a number
    a.pbrt:10:1: error: Translate: number 3 of 3: Shape is no number
      hint: expected a number
    a.pbrt:10:16: error: "radius" is -0
      hint: it must be above 0
    a.pbrt:11:7: error: Scale: number 1 of 3: 1e300 does not fit a 32-bit float
      hint: floats go up to 3.4e38
    "#);
}

#[test]
fn transforms_without_an_inverse() {
    assert_snapshot!(complaints(
        "Scale 1 0 1\n\
         Rotate 30 0 0 0\n\
         LookAt 0 0 0  0 0 0  0 1 0\n\
         LookAt 0 0 0  0 1 0  0 1 0\n\
         Transform [ 1 0 0 0  1 0 0 0  0 0 1 0  0 0 0 1 ]\n\
         ConcatTransform [ 1 0 0 0  0 1 0 0  0 0 1 0  0 0 0 ]\n\
         Transform 1 0 0 0\n\
         CoordSysTransform \"wrold\"\n\
         ActiveTransform \"All\""
    ), @r#"
    a.pbrt:2:1: error: a singular transform: it has no inverse
      hint: no factor may be 0
    a.pbrt:3:1: error: a singular transform: it has no inverse
      hint: the axis must not be zero
    a.pbrt:4:1: error: a singular transform: it has no inverse
      hint: eye and target must differ, and up must not point along the view
    a.pbrt:5:1: error: a singular transform: it has no inverse
      hint: eye and target must differ, and up must not point along the view
    a.pbrt:6:1: error: a singular transform: it has no inverse
      hint: no two axes may coincide and none may be zero
    a.pbrt:7:52: error: ConcatTransform: number 16 of 16 is missing
      hint: expected a number
    a.pbrt:8:11: error: Transform: expected [
      hint: it takes 16 numbers in brackets
    a.pbrt:9:19: warning: unknown coordinate system "wrold"
      hint: the directive is ignored, as in pbrt; did you mean "world"?
    a.pbrt:10:17: error: unknown ActiveTransform
      hint: expected StartTime, EndTime or All, without quotes
    "#);
}

#[test]
fn blocks_that_do_not_match() {
    assert_snapshot!(complaints("AttributeEnd"), @r#"
    a.pbrt:2:1: error: unmatched AttributeEnd
      hint: no block is open here: remove it
    "#);
    assert_snapshot!(complaints("AttributeBegin\nAttributeBegin\nAttributeEnd"), @r#"
    a.pbrt:2:1: error: AttributeBegin without AttributeEnd
      hint: add AttributeEnd
    "#);
    assert_snapshot!(complaints("ObjectBegin \"a\"\nAttributeEnd\nObjectEnd"), @r#"
    a.pbrt:3:1: error: unmatched AttributeEnd
      hint: ObjectBegin at a.pbrt:2:1 is still open
    a.pbrt:4:1: error: unmatched ObjectEnd
      hint: no block is open here: remove it
    "#);
    assert_snapshot!(complaints("ObjectBegin \"a\"\nObjectBegin \"b\"\nObjectEnd\nObjectEnd"), @r#"
    a.pbrt:3:1: error: ObjectBegin within ObjectBegin
      hint: objects do not nest: end the first
    "#);
    assert_snapshot!(complaints("ObjectBegin \"a\"\nObjectInstance \"a\"\nObjectEnd\nObjectInstance \"b\"\nObjectBegin \"a\"\nObjectEnd"), @r#"
    a.pbrt:3:1: error: ObjectInstance within ObjectBegin
      hint: pbrt has no instances within objects: repeat the shapes
    a.pbrt:5:16: error: unknown object "b"
      hint: there is only "a"
    a.pbrt:6:13: error: object "a" is defined twice
      hint: the first is at a.pbrt:2:13
    "#);
    assert_snapshot!(load("AttributeBegin\nShape \"sphere\"\nWorldBegin\nCamera \"perspective\"\nWorldBegin").1, @r#"
    a.pbrt:1:1: error: AttributeBegin before WorldBegin
      hint: shapes, lights and materials stand after WorldBegin
    a.pbrt:2:1: error: Shape before WorldBegin
      hint: shapes, lights and materials stand after WorldBegin
    a.pbrt:4:1: error: Camera after WorldBegin
      hint: options, such as camera and film, stand before WorldBegin
    a.pbrt:5:1: error: WorldBegin after WorldBegin
      hint: options, such as camera and film, stand before WorldBegin
    "#);
}

#[test]
fn names_that_nothing_has() {
    assert_snapshot!(complaints(
        "MakeNamedMaterial \"Glass\" \"string type\" \"dielectric\"\n\
         MakeNamedMaterial \"Glass\" \"string type\" \"dielectric\"\n\
         MakeNamedMaterial \"Nothing\"\n\
         NamedMaterial \"Glas\"\n\
         Shape \"sphere\"\nShape \"sphere\"\n\
         Texture \"wood\" \"spectrum\" \"constant\"\n\
         Material \"diffuse\" \"texture reflectance\" \"wod\"\n\
         Shape \"sphere\" \"texture alpha\" \"wood\"\n\
         Material \"conductor\" \"spectrum eta\" \"metal-Ag-ets\"\n\
         Material \"mix\" \"string materials\" [ \"Glass\" \"Later\" ]\n\
         MediumInterface \"fog\" \"\"\n\
         Material \"diffuse\"\n\
         Shape \"sphere\""
    ), @r#"
    a.pbrt:3:1: error: material "Glass" is defined twice
      hint: the first is at a.pbrt:2:1
    a.pbrt:4:1: error: MakeNamedMaterial "Nothing" has no type
      hint: add one, as in "string type" "diffuse"
    a.pbrt:5:15: error: unknown named material "Glas"
      hint: did you mean "Glass"?
    a.pbrt:9:20: error: unknown spectrum texture "wod"
      hint: did you mean "wood"?
    a.pbrt:10:16: error: "wood" is a spectrum texture, and "alpha" takes a float texture
      hint: declare a second texture of that kind
    a.pbrt:11:22: error: "metal-Ag-ets" is no spectrum that is known, and no file
      hint: did you mean "metal-Ag-eta"?
    a.pbrt:12:16: error: unknown named material (so far) "Later"
      hint: there is only "Glass"
    a.pbrt:13:17: error: unknown medium "fog"
      hint: no medium is defined
    "#);
}

#[test]
fn shapes_that_make_no_sense() {
    assert_snapshot!(complaints(
        "Shape \"trianglemesh\" \"point3 P\" [ 0 0 0 1 0 0 0 1 0 ] \"integer indices\" [ 0 1 3 ]\n\
         Shape \"trianglemesh\" \"point3 P\" [ 0 0 0 1 0 0 0 1 0 ] \"integer indices\" [ 0 1 -1 ]\n\
         Shape \"trianglemesh\" \"point3 P\" [ 0 0 0 1 0 0 0 1 0 ] \"integer indices\" [ 0 1 ]\n\
         Shape \"trianglemesh\" \"point3 P\" [ 0 0 0 1 0 0 0 1 0 ] \"normal N\" [ 0 0 1 ]\n\
         Shape \"trianglemesh\" \"point3 P\" [ 0 0 0 1 0 0 0 1 0 ] \"point3 P1\" [ 0 0 0 1 0 0 ]\n\
         Shape \"trianglemesh\" \"point3 P\" [ 0 0 0 1 0 0 0 1 0 ] \"normal N1\" [ 0 0 1 0 0 1 0 0 1 ]\n\
         Shape \"trianglemesh\" \"point3 P\" [ 0 0 0 1 ]\n\
         Shape \"trianglemesh\" \"integer indices\" [ 0 1 2 ]\n\
         Shape \"trianglemesh\" \"float P\" [ 0 0 0 1 0 0 0 1 0 ]\n\
         Shape \"sphere\" \"float radius\" 0\n\
         Shape \"disk\" \"float innerradius\" 2\n\
         Shape \"cylinder\" \"float zmax\" -1\n\
         Shape \"curve\" \"point3 P\" [ 0 0 0 1 0 0 ]\n\
         Shape \"curve\" \"point3 P\" [ 0 0 0 1 0 0 2 0 0 3 0 0 ] \"string type\" \"ribbon\"\n\
         Shape \"loopsubdiv\" \"integer levels\" 40 \"point3 P\" [ 0 0 0 1 0 0 0 1 0 ]\n\
         Shape \"plymesh\" \"string filename\" \"absent.ply\""
    ), @r#"
    a.pbrt:2:55: error: index 3 (number 3) is out of range
      hint: there are 3 vertices: 0 to 2
    a.pbrt:3:55: error: index -1 (number 3) is out of range
      hint: there are 3 vertices: 0 to 2
    a.pbrt:4:55: error: 2 indices do not make faces of 3 corners
      hint: expected a multiple of 3
    a.pbrt:5:55: error: "N" has 1 items for 3 vertices
      hint: expected 3
    a.pbrt:6:55: error: "P1" has 2 items for 3 vertices
      hint: expected 3
    a.pbrt:7:55: error: "N1" without "N" and "P1"
      hint: it says how the normals "N" turn
    a.pbrt:8:22: error: "point3 P" has 4 values
      hint: expected a multiple of 3
    a.pbrt:9:1: error: shape "trianglemesh" has no vertices
      hint: add "point3 P" [ … ]
    a.pbrt:10:22: error: "P" is of the wrong type
      hint: it takes "point3"
    a.pbrt:11:16: error: "radius" is 0
      hint: it must be above 0
    a.pbrt:12:14: error: "innerradius" is 2
      hint: expected 0 to the radius, 1
    a.pbrt:13:18: error: a cylinder without height
      hint: "zmin" and "zmax" must differ
    a.pbrt:14:15: error: a bezier curve of degree 3 with 2 control points
      hint: expected 4 + n × 3
    a.pbrt:15:1: error: a ribbon of 1 segments with 0 normals
      hint: expected 2
    a.pbrt:16:20: error: "levels" is 40
      hint: expected 0 to 10
    a.pbrt:17:17: error: absent.ply: cannot be read: No such file or directory (os error 2)
      hint: paths are relative to the main scene file's folder
    "#);
}

#[test]
fn cameras_and_films_that_make_no_sense() {
    let said = |text: &str| load(format!("{text}\nWorldBegin")).1;
    assert_snapshot!(said("Film \"rgb\" \"integer xresolution\" 0"), @r#"
    a.pbrt:1:12: error: "xresolution" is 0
      hint: expected 1 to 65536
    "#);
    assert_snapshot!(said("Film \"rgb\" \"integer xresolution\" 60000 \"integer yresolution\" 60000"), @r#"
    a.pbrt:1:1: error: a film of 60000 by 60000 pixels
      hint: at most 268435456 pixels are possible
    "#);
    assert_snapshot!(said("Film \"rgb\" \"float cropwindow\" [ 0.5 0.5 0 1 ]\nCamera \"perspective\" \"float fov\" 180"), @r#"
    a.pbrt:1:12: error: "cropwindow" [0.5, 0.5, 0.0, 1.0] leaves no pixel
      hint: expected x0 x1 y0 y1
    a.pbrt:2:22: error: a field of view of 180 degrees
      hint: expected 0 to 180
    "#);
    assert_snapshot!(said("Camera \"perspective\" \"float shutterclose\" 0\nPixelFilter \"box\" \"float xradius\" -1"), @r#"
    a.pbrt:1:22: error: the shutter closes at 0, not after it opens at 0
      hint: "shutterclose" must be above "shutteropen"
    a.pbrt:2:19: error: a filter of radius -1 by 0.5
      hint: expected above 0 and at most 16 pixels
    "#);
    assert_snapshot!(said("Sampler \"sobol\" \"integer pixelsamples\" 0\nIntegrator \"path\" \"integer maxdepth\" -1"), @r#"
    a.pbrt:1:17: error: "pixelsamples" is 0
      hint: expected 1 to 16777216
    a.pbrt:2:19: error: "maxdepth" is -1
      hint: expected 0 to 2147483647
    "#);
    assert_snapshot!(said("Sampler \"soboll\"\nIntegrator \"paht\"\nFilm \"rbg\"\nPixelFilter \"gauss\"\nCamera \"perspectiv\"\nColorSpace \"srgbb\"\nOption \"sed\" 3"), @r#"
    a.pbrt:1:1: error: unknown sampler "soboll"
      hint: did you mean "sobol"?
    a.pbrt:2:1: error: unknown integrator "paht"
      hint: did you mean "path"?
    a.pbrt:3:1: error: unknown film "rbg"
      hint: possible are "rgb", "gbuffer" and "spectral"
    a.pbrt:4:1: error: unknown filter "gauss"
      hint: did you mean "gaussian"?
    a.pbrt:5:1: error: unknown camera "perspectiv"
      hint: did you mean "perspective"?
    a.pbrt:6:12: error: unknown colour space "srgbb"
      hint: did you mean "srgb"?
    a.pbrt:7:8: error: unknown option "sed"
      hint: did you mean "seed"?
    "#);
}

#[test]
fn what_is_not_there_yet_is_named_with_what_is_done_instead() {
    let text = "Camera \"perspective\"\n\
         Film \"gbuffer\" \"string sensor\" \"canon_eos_5d\" \"float maxcomponentvalue\" 10\n\
         Option \"forcediffuse\" true\n\
         WorldBegin\n\
         Material \"hair\" \"float eumelanin\" 0.3\n\
         # nothing\n\
         Material \"subsurface\"\n\
         Texture \"p\" \"float\" \"ptex\" \"string filename\" \"a.ptx\"\n\
         # nothing either\n\
         Shape \"sphere\" \"bool alpha\" [ \"true\" ]\n\
         AreaLightSource \"diffuse\"\n\
         Material \"interface\"\nShape \"sphere\"\n\
         ObjectBegin \"o\" Material \"diffuse\" Shape \"sphere\" ObjectEnd\n\
         ActiveTransform EndTime Translate 1 0 0\nShape \"sphere\"\nLightSource \"point\"";
    let text = text.replace("Shape \"sphere\" \"bool alpha\" [ \"true\" ]\n", "");
    assert_snapshot!(load(text).1, @r#"
    a.pbrt:2:1: warning: film "gbuffer" is not supported
      hint: film "rgb" is used: the picture is the same, without the other channels
    a.pbrt:2:16: warning: sensor "canon_eos_5d" is not supported
      hint: cie1931 is used, with the same exposure: colours differ
    a.pbrt:2:47: warning: "maxcomponentvalue" 10 is ignored
      hint: it would make the picture darker than it is; samples are not clamped
    a.pbrt:3:8: warning: option "forcediffuse" is not supported
      hint: it is ignored
    a.pbrt:8:1: warning: ptex textures are not supported
      hint: a constant 0.5 stands in for it
    a.pbrt:12:1: warning: a shape of material "interface" cannot emit
      hint: its area light is ignored
    a.pbrt:13:36: warning: a shape in an object emits
      hint: pbrt-v4 has no such light: there it is dark
    a.pbrt:15:1: warning: a shape of material "interface" cannot emit
      hint: its area light is ignored
    a.pbrt:16:1: warning: a light cannot move
      hint: its transform at the start time is used, as in pbrt
    "#);
}

#[test]
fn pbrt_v3_is_upgraded_and_says_what_it_cannot() {
    let (scene, said) = load(
        "Film \"image\" \"integer xresolution\" 10 \"float scale\" 2\nPixelFilter \"box\" \"float xwidth\" 1\n\
         Integrator \"directlighting\" \"string strategy\" \"all\"\nWorldBegin\n\
         LightSource \"infinite\" \"rgb L\" [ 1 2 3 ] \"color scale\" [ 2 2 1 ]\n\
         Texture \"t\" \"color\" \"scale\" \"rgb tex1\" [ .5 .5 .5 ] \"rgb tex2\" [ 1 .5 .5 ]\n\
         Material \"matte\" \"texture Kd\" \"t\" \"float sigma\" 20\n\
         Shape \"trianglemesh\" \"point P\" [ 0 0 0 1 0 0 0 1 0 ] \"float uv\" [ 0 0 1 0 0 1 ]\n\
         Material \"uber\" \"rgb Kd\" [ .1 .2 .3 ] \"rgb Kr\" [ 1 1 1 ] \"rgb opacity\" [ .5 .5 .5 ]\nShape \"sphere\"\n\
         Material \"glass\" \"rgb Kt\" [ 1 .5 1 ] \"float index\" 1.3\nShape \"cone\"\n\
         Material \"plastic\" \"float roughness\" .1 \"rgb Kx\" [ 1 1 1 ]\nWorldEnd # end\n",
    );
    assert_snapshot!(said);
    let folder = Folder::new().with(
        "b.pbrt",
        "WorldBegin\nMaterial \"plastic\" \"float roughness\" .1\nShape \"sphere\"\nWorldEnd\n",
    );
    assert!(scene.is_none());
    let scene = folder.load("b.pbrt").0.unwrap();
    let scene_desc::MaterialKind::CoatedDiffuse { roughness, .. } = &scene.materials[1].kind else {
        panic!()
    };
    // pbrt-v3's own curve, not the root.
    assert!(matches!(roughness.u, scene_desc::FloatInput::Constant(a) if (a - 0.4617).abs() < 1e-3));
    assert!(matches!(scene.filter, scene_desc::FilterDesc::Box { radius: [0.5, 0.5] }));
}

#[test]
fn missing_images_are_errors_at_their_place() {
    assert_snapshot!(complaints(
        "Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"absent.png\"\n\
         Texture \"u\" \"float\" \"imagemap\" \"string filename\" \"absent.png\"\n\
         Texture \"v\" \"float\" \"imagemap\"\n\
         Material \"diffuse\" \"texture reflectance\" \"t\" \"string normalmap\" \"n.png\"\n\
         LightSource \"infinite\" \"string filename\" \"sky.exr\""
    ), @r#"
    a.pbrt:2:35: error: image absent.png cannot be read: No such file or directory (os error 2)
      hint: paths are relative to the main scene file's folder
    a.pbrt:4:1: error: texture "imagemap" has no "filename"
      hint: add "string filename" "…"
    a.pbrt:5:46: error: image n.png cannot be read: No such file or directory (os error 2)
      hint: paths are relative to the main scene file's folder
    a.pbrt:6:24: error: image sky.exr cannot be read: No such file or directory (os error 2)
      hint: paths are relative to the main scene file's folder
    "#);
}

#[test]
fn files_that_include_themselves_are_refused() {
    let folder = Folder::new()
        .with("a.pbrt", "WorldBegin\nInclude \"b.pbrt\"\nInclude \"absent.pbrt\"")
        .with("b.pbrt", "Shape \"sphere\"\n  Include \"c.pbrt\"")
        .with("c.pbrt", "Include \"b.pbrt\"");
    let said = folder.load("a.pbrt").1;
    let said: Vec<_> = said.lines().filter(|l| !l.contains("chain")).collect();
    assert_snapshot!(said.join("\n"), @r#"
    a.pbrt:3:9: error: absent.pbrt cannot be read: No such file or directory (os error 2)
      hint: paths are relative to the main scene file's folder
    c.pbrt:1:9: error: b.pbrt includes itself
    "#);
}

#[test]
fn bombs_are_bounded() {
    let start = Instant::now();
    // Sixty files, each of which includes the next one twice: 2⁶⁰ in all.
    let mut folder = Folder::new().with("a.pbrt", "WorldBegin\nInclude \"0.pbrt\"");
    for i in 0..60 {
        let filler = "# and a long comment\n".repeat(20_000);
        let text = format!("{filler}Include \"{0}.pbrt\"\nInclude \"{0}.pbrt\"\n", i + 1);
        folder = folder.with(&format!("{i}.pbrt"), text);
    }
    let folder = folder.with("60.pbrt", "Shape \"sphere\"");
    let said = folder.load("a.pbrt").1;
    assert!(said.contains("again and again"), "{said}");

    // Blocks without end.
    let said = complaints(&"AttributeBegin ".repeat(200_000));
    assert!(said.contains("nested more than"), "{said}");

    // A million mistakes are a page.
    let said = complaints(&"Xyzzy\nShape \"cube\"\n".repeat(300_000));
    assert!(said.lines().count() < 60, "{}", said.lines().count());

    // A file of many shapes, again and again.
    let shapes = "Shape \"sphere\"\n".repeat(100_000);
    let main = format!("WorldBegin\n{}", "Include \"b.pbrt\"\n".repeat(1000));
    let said = Folder::new().with("a.pbrt", main).with("b.pbrt", shapes).load("a.pbrt").1;
    assert!(said.contains("again and again"), "{said}");

    assert!(start.elapsed() < Duration::from_secs(20), "{:?}", start.elapsed());
}

#[test]
fn a_gzip_bomb_is_refused() {
    use std::io::Write;
    let mut gz = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    let zeros = vec![0_u8; 1 << 20];
    for _ in 0..300 {
        gz.write_all(&zeros).unwrap();
    }
    let folder = Folder::new().with("a.pbrt.gz", gz.finish().unwrap());
    assert_snapshot!(folder.load("a.pbrt.gz").1, @r#"
    a.pbrt.gz: error: a.pbrt.gz cannot be read: unpacks to more than 268435456 bytes, more than 64 times its size
      hint: unpack it to see whether it is meant so
    "#);
}
