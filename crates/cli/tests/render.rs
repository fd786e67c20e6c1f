//! Renders of a small scene, as a person would ask for them.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod common;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use common::{Answer, answer, steradian};
use tempfile::{TempDir, tempdir};

/// A floor under a lamp, and a ball; the file asks for 4 samples and depth 3.
const SCENE: &str = r#"
Film "rgb" "integer xresolution" 48 "integer yresolution" 36 "string filename" "ball.exr"
Sampler "zsobol" "integer pixelsamples" 4
Integrator "path" "integer maxdepth" 3
LookAt 0 -4 2  0 0 0.5  0 0 1
Camera "perspective" "float fov" 45
WorldBegin
Material "diffuse" "rgb reflectance" [0.6 0.5 0.4]
Shape "trianglemesh" "point3 P" [-3 -3 0  3 -3 0  3 3 0  -3 3 0] "integer indices" [0 1 2 0 2 3]
Shape "sphere" "float radius" 0.5
AttributeBegin
  AreaLightSource "diffuse" "rgb L" [5 5 5]
  Translate 0 0 3
  ReverseOrientation
  Shape "disk" "float radius" 1
AttributeEnd
"#;

struct Folder(TempDir);

impl Folder {
    fn new() -> Self {
        let folder = tempdir().unwrap();
        fs::write(folder.path().join("ball.pbrt"), SCENE).unwrap();
        Self(folder)
    }

    fn path(&self) -> &Path {
        self.0.path()
    }

    fn file(&self, name: &str) -> PathBuf {
        self.path().join(name)
    }

    fn bytes(&self, name: &str) -> Vec<u8> {
        fs::read(self.file(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
    }

    /// `steradian render ball.pbrt` and more.
    fn render(&self, args: &[&str]) -> Answer {
        steradian(self.path(), &[&["render", "ball.pbrt"], args].concat())
    }

    /// The same, which must go well.
    fn rendered(&self, args: &[&str]) -> Answer {
        let answer = self.render(args);
        assert_eq!(answer.code, 0, "{args:?}\n{}", answer.all());
        answer
    }
}

#[test]
fn a_render_writes_what_is_asked_for_and_reports_it() {
    let folder = Folder::new();
    let answer = folder.rendered(&["-o", "a.exr", "-o", "a.png", "-o", "a.hdr", "-o", "a.pfm", "--json"]);
    let json = answer.json();
    assert_eq!(answer.stdout.lines().count(), 1);
    assert_eq!(answer.stderr, "", "silent in a pipe");
    for key in ["wall_seconds", "load_seconds", "render_seconds", "relmse_estimate"] {
        assert!(json[key].as_f64().unwrap() >= 0.0, "{key}");
    }
    assert_eq!(
        (&json["spp"], &json["passes_resumed"], &json["dropped_samples"]),
        (&4.into(), &0.into(), &0.into())
    );
    assert!(json["rays"].as_u64().unwrap() > json["camera_paths"].as_u64().unwrap());
    assert!(json["camera_paths"].as_u64().unwrap() >= 4 * 48 * 36);
    assert!(json["mean"].as_array().unwrap().iter().all(|m| m.as_f64().unwrap() > 0.01));
    assert_eq!(json["outputs"], serde_json::json!(["a.exr", "a.png", "a.hdr", "a.pfm"]));

    let exr = image::load_image(&folder.file("a.exr")).unwrap();
    assert_eq!((exr.width(), exr.height()), (48, 36));
    for channel in ["R", "G", "B", "variance.R", "variance.G", "variance.B"] {
        assert!(exr.channel(channel).is_some(), "{channel} of {:?}", exr.channels());
    }
    for note in ["version", "scene", "integrator", "settings", "seed", "passes"] {
        assert!(exr.metadata.contains_key(&format!("steradian.{note}")), "{note}");
    }
    for name in ["a.png", "a.hdr", "a.pfm"] {
        assert_eq!(image::load_image(&folder.file(name)).unwrap().width(), 48, "{name}");
    }
}

#[test]
fn without_a_name_the_files_own_is_used_here() {
    let folder = Folder::new();
    let answer = folder.rendered(&["--spp", "1"]);
    assert!(folder.file("ball.exr").exists() && folder.file("ball.png").exists());
    assert!(answer.stdout.contains("wrote ball.exr") && answer.stdout.contains("wrote ball.png"));
    assert_eq!(folder.rendered(&["--spp", "1", "--quiet"]).stdout, "");
}

#[test]
fn the_same_seed_gives_the_same_bytes_whatever_the_threads_and_kernels() {
    let folder = Folder::new();
    folder.rendered(&["-o", "1.exr", "--threads", "1"]);
    folder.rendered(&["-o", "2.exr", "--threads", "2"]);
    folder.rendered(&["-o", "5.exr", "--threads", "5"]);
    folder.rendered(&["-o", "s.exr", "--isa", "scalar"]);
    for name in ["2.exr", "5.exr", "s.exr"] {
        assert!(folder.bytes("1.exr") == folder.bytes(name), "{name}");
    }
    folder.rendered(&["-o", "other.exr", "--seed", "1"]);
    assert!(folder.bytes("1.exr") != folder.bytes("other.exr"));
}

#[test]
fn parts_are_merged_to_the_whole() {
    let folder = Folder::new();
    folder.rendered(&["-o", "whole.exr", "--passes", "0..8"]);
    let first = folder.rendered(&["--passes", "0..3", "--partial", "a.part", "--json"]);
    assert_eq!(first.json()["outputs"], serde_json::json!(["a.part"]));
    folder.rendered(&["--passes", "3..8", "--partial", "b.part"]);
    let answer = steradian(folder.path(), &["merge", "b.part", "a.part", "-o", "merged.exr"]);
    assert_eq!(answer.code, 0, "{}", answer.all());
    assert!(folder.bytes("whole.exr") == folder.bytes("merged.exr"));
    folder.rendered(&["--passes", "8..9", "--partial", "c.part", "--integrator", "ao"]);
    let answer = steradian(folder.path(), &["merge", "a.part", "c.part", "-o", "x.exr"]);
    assert!(answer.code == 2 && answer.stderr.contains("integrators path and ao"), "{}", answer.all());
}

#[test]
fn a_resumed_render_is_the_uninterrupted_one() {
    let folder = Folder::new();
    folder.rendered(&["-o", "whole.exr", "--spp", "8"]);
    folder.rendered(&["-o", "half.exr", "--spp", "4", "--checkpoint", "c"]);
    let json = folder
        .rendered(&["-o", "resumed.exr", "--spp", "8", "--checkpoint", "c", "--resume", "--json"])
        .json();
    assert_eq!((&json["spp"], &json["passes_resumed"]), (&8.into(), &4.into()));
    assert!(folder.bytes("whole.exr") == folder.bytes("resumed.exr"));

    // What does not fit is refused and left as it is.
    let before = folder.bytes("c");
    let answer = folder.render(&["-o", "x.exr", "--checkpoint", "c", "--resume", "--seed", "7"]);
    assert!(answer.code == 2 && answer.stderr.contains("c cannot be resumed"), "{}", answer.all());
    assert!(before == folder.bytes("c") && !folder.file("x.exr").exists());

    // Nor is another file overwritten.
    fs::write(folder.file("notes"), "dear diary").unwrap();
    let answer = folder.render(&["-o", "x.exr", "--checkpoint", "notes"]);
    assert!(answer.code == 1 && answer.stderr.contains("no checkpoint"), "{}", answer.all());
    assert_eq!(folder.bytes("notes"), b"dear diary");

    // A checkpoint that is not there yet is no obstacle.
    folder.rendered(&["-o", "new.exr", "--spp", "8", "--checkpoint", "new", "--resume"]);
    assert!(folder.bytes("whole.exr") == folder.bytes("new.exr"));
}

/// Starts a render that would take hours.
fn endless(folder: &Folder, more: &[&str]) -> std::process::Child {
    let args = [&["render", "ball.pbrt", "--spp", "100000000"], more].concat();
    let mut command = Command::new(env!("CARGO_BIN_EXE_steradian"));
    command
        .args(args)
        .current_dir(folder.path())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

fn signal(child: &std::process::Child, name: &str) {
    let status = Command::new("kill").args([name, &child.id().to_string()]).status().unwrap();
    assert!(status.success());
}

fn wait_for(what: impl Fn() -> bool) {
    let start = Instant::now();
    while !what() {
        assert!(start.elapsed() < Duration::from_secs(30), "waited in vain");
        std::thread::sleep(Duration::from_millis(10));
    }
}

#[test]
#[cfg(unix)]
fn ctrl_c_saves_what_was_rendered() {
    let folder = Folder::new();
    let checkpoint = ["-o", "a.exr", "--json", "--checkpoint", "c", "--checkpoint-every", "50ms"];
    let child = endless(&folder, &checkpoint);
    wait_for(|| folder.file("c").exists());
    signal(&child, "-INT");
    let answer = answer(&child.wait_with_output().unwrap());
    assert_eq!(answer.code, 130, "{}", answer.all());
    let spp = answer.json()["spp"].as_u64().unwrap();
    assert!(spp >= 1 && answer.stderr.contains(&format!("interrupted; {spp} passes are saved")));
    folder.rendered(&["-o", "b.exr", "--spp", &spp.to_string()]);
    assert!(folder.bytes("a.exr") == folder.bytes("b.exr"));
}

#[test]
#[cfg(unix)]
fn a_kill_costs_no_more_than_the_interval() {
    let folder = Folder::new();
    let checkpoint = ["-o", "a.exr", "--checkpoint", "c", "--checkpoint-every", "20ms"];
    let mut child = endless(&folder, &checkpoint);
    wait_for(|| folder.file("c").exists());
    std::thread::sleep(Duration::from_millis(130));
    signal(&child, "-KILL");
    child.wait().unwrap();
    assert!(!folder.file("a.exr").exists());
    let resumed = ["-o", "r.exr", "--checkpoint", "c", "--resume", "--json", "--spp", "1"];
    let json = folder.rendered(&resumed).json();
    let spp = json["spp"].as_u64().unwrap();
    assert!(json["passes_resumed"].as_u64().unwrap() == spp && spp >= 1);
    folder.rendered(&["-o", "b.exr", "--spp", &spp.to_string()]);
    assert!(folder.bytes("r.exr") == folder.bytes("b.exr"));
}

#[test]
fn a_time_is_kept_and_gives_whole_passes() {
    let folder = Folder::new();
    let json = folder.rendered(&["-o", "a.exr", "--time", "300ms", "--json"]).json();
    let seconds = json["render_seconds"].as_f64().unwrap();
    assert!((0.3..1.0).contains(&seconds), "{seconds}");
    let spp = json["spp"].as_u64().unwrap();
    folder.rendered(&["-o", "b.exr", "--spp", &spp.to_string()]);
    assert!(folder.bytes("a.exr") == folder.bytes("b.exr"));
}

#[test]
fn a_crop_has_the_bits_of_the_whole() {
    let folder = Folder::new();
    folder.rendered(&["-o", "whole.exr"]);
    folder.rendered(&["-o", "crop.exr", "--crop", "10,8,30,20"]);
    let whole = image::load_image(&folder.file("whole.exr")).unwrap();
    let crop = image::load_image(&folder.file("crop.exr")).unwrap();
    assert_eq!((crop.width(), crop.height(), crop.origin, crop.full_size), (20, 12, [10, 8], [48, 36]));
    for (x, y) in (0..12).flat_map(|y| (0..20).map(move |x| (x, y))) {
        assert_eq!(crop.pixel(x, y), whole.pixel(x + 10, y + 8));
    }
    let answer = folder.render(&["-o", "x.exr", "--crop", "100,100,120,120"]);
    assert!(answer.code == 2 && !folder.file("x.exr").exists(), "{}", answer.all());
    let json = folder.rendered(&["-o", "small.exr", "--resolution", "20x10", "--json"]).json();
    assert!(json["camera_paths"].as_u64().unwrap() < 4 * 48 * 36);
    assert_eq!(image::load_image(&folder.file("small.exr")).unwrap().width(), 20);
}

#[test]
fn an_integrator_keeps_the_files_depth_and_set_wins() {
    let folder = Folder::new();
    let settings = |args: &[&str]| {
        let args = [&["-o", "a.exr", "--spp", "1", "--json"], args].concat();
        folder.rendered(&args).json()["settings"].as_str().unwrap().to_owned()
    };
    assert!(settings(&[]).contains("max_depth=3 "));
    assert!(settings(&["--set", "max_depth=1"]).contains("max_depth=1 "));
    assert!(settings(&["--set", "max_depth=none"]).contains("max_depth=none "));
    assert!(settings(&["--set", "light_selection=power"]).contains("light_selection=power"));
    assert!(settings(&["--set", "sampler=independent"]).contains("sampler=independent"));
    assert!(settings(&["--integrator", "ao"]).contains("sampling=cosine"));
    for (args, sentence) in [
        (["--integrator", "paht"], "there is no integrator `paht`"),
        (["--set", "depth=3"], "has no parameter `depth`"),
        (["--set", "max_depth=deep"], "cannot be `deep`"),
        (["--set", "sampler=dice"], "sobol, independent or stratified"),
        (["-D", "x=1"], "no parameter `x`"),
    ] {
        let answer = folder.render(&[&args[..], &["-o", "x.exr"]].concat());
        assert!(answer.code == 2 && answer.stderr.contains(sentence), "{}", answer.all());
        assert!(!folder.file("x.exr").exists());
    }
}

#[test]
fn warnings_stop_only_the_strict() {
    let folder = Folder::new();
    let scene = SCENE.replace("\"string filename\"", "\"float maxcomponentvalue\" 9 \"string filename\"");
    fs::write(folder.file("ball.pbrt"), scene).unwrap();
    let answer = folder.rendered(&["-o", "a.exr"]);
    assert!(
        answer.stderr.contains("ball.pbrt:2:") && answer.stderr.contains("warning: "),
        "{}",
        answer.all()
    );
    let answer = folder.render(&["-o", "b.exr", "--strict"]);
    assert!(answer.stderr.contains("ball.pbrt:2:") && answer.stderr.contains("error: "), "{}", answer.all());
    assert!(answer.code == 2 && !folder.file("b.exr").exists());
}

#[test]
fn info_counts_what_is_there() {
    let folder = Folder::new();
    let answer = steradian(folder.path(), &["info", "ball.pbrt", "--json"]);
    assert_eq!(answer.code, 0, "{}", answer.all());
    let json = answer.json();
    assert_eq!((&json["shapes"], &json["area_lights"], &json["lights"]), (&3.into(), &1.into(), &0.into()));
    assert_eq!((&json["triangles"], &json["other_primitives"]), (&2.into(), &2.into()));
    assert_eq!((&json["spp"], &json["resolution"]), (&4.into(), &serde_json::json!([48, 36])));
    assert!(json["memory_bytes"].as_u64().unwrap() > 0 && json["unsupported"].as_array().unwrap().is_empty());
    let text = steradian(folder.path(), &["info", "ball.pbrt"]).stdout;
    assert!(text.contains("triangles     2\n") && text.contains("48 x 36, 4 samples"), "{text}");
}

#[test]
fn a_replayed_path_is_the_one_of_the_render() {
    let folder = Folder::new();
    let scene = SCENE
        .replace("WorldBegin", "PixelFilter \"box\" \"float xradius\" 0.5 \"float yradius\" 0.5\nWorldBegin");
    fs::write(folder.file("ball.pbrt"), scene).unwrap();
    folder.rendered(&["-o", "a.exr", "--passes", "5..6", "--seed", "9"]);
    let whole = image::load_image(&folder.file("a.exr")).unwrap().to_rgb().unwrap();
    for (x, y) in [(24, 20), (3, 30), (40, 5)] {
        let pixel = format!("{x},{y}");
        let args = ["replay", "ball.pbrt", "--pixel", &pixel, "--pass", "5", "--seed", "9", "--json"];
        let answer = steradian(folder.path(), &args);
        assert_eq!(answer.code, 0, "{}", answer.all());
        let json = answer.json();
        for c in 0..3 {
            assert_eq!(json["rgb"][c].as_f64().unwrap() as f32, whole.pixel(x, y)[c]);
        }
    }
    let args = ["replay", "ball.pbrt", "--pixel", "-2,-1", "--pass", "0"];
    assert_eq!(steradian(folder.path(), &args).code, 0, "the filter's border is sampled too");
    let far = steradian(folder.path(), &["replay", "ball.pbrt", "--pixel", "500,5", "--pass", "0"]);
    assert!(far.code == 2 && far.all().contains("outside of the film"), "{}", far.all());
}

#[test]
fn error_ends_when_the_picture_is_precise_and_gives_the_same_bits_again() {
    let folder = Folder::new();
    let coarse = folder.rendered(&["--error", "20%", "-o", "a.exr", "--json"]);
    let fine = folder.rendered(&["--error", "0.01", "-o", "b.exr", "--json"]);
    let spp = |a: &Answer| a.json()["spp"].as_u64().unwrap();
    assert!(8 <= spp(&coarse) && spp(&coarse) < spp(&fine), "{} {}", spp(&coarse), spp(&fine));
    folder.rendered(&["--error", "20%", "-o", "c.exr", "--threads", "1"]);
    assert_eq!(folder.bytes("a.exr"), folder.bytes("c.exr"));
    assert!(fine.json()["relmse_estimate"].as_f64().unwrap() < 0.01 * 0.01);
}

#[test]
fn compare_writes_a_report_that_stands_alone_and_finds_agreement() {
    let folder = Folder::new();
    let compare = |methods: &str, out: &str| {
        let answer = steradian(
            folder.path(),
            &["compare", "ball.pbrt", "--integrators", methods, "--spp", "16", "--seeds", "3", "-o", out]
                .into_iter()
                .chain(["--cache", "kept", "--reference-error", "2e-3", "--json"])
                .collect::<Vec<_>>(),
        );
        assert_eq!(answer.code, 0, "{}", answer.all());
        answer.json()
    };
    let json = compare("path,bdpt,path:mis=false", "out");
    assert_eq!(json["methods"].as_array().unwrap().len(), 3);
    let verdicts = json["agreements"].as_array().unwrap();
    assert_eq!(verdicts.len(), 6, "three pairs, and each against the reference");
    assert!(verdicts.iter().all(|a| a["verdict"]["agrees"] == true), "{verdicts:?}");
    for method in json["methods"].as_array().unwrap() {
        let slope = method["slope"]["samples"]["value"].as_f64().unwrap();
        assert!(slope < -0.7, "Sobol points fall as fast as independent ones or faster: {slope}");
    }
    let page = String::from_utf8(folder.bytes("out/report.html")).unwrap();
    assert!(page.contains("ball") && page.contains("path:mis=false") && !page.contains("{{"));
    assert!(!page.contains("src=\"http") && !page.contains("href=\"http"), "opens without a network");
    assert!(folder.file("out/bdpt.exr").exists() && folder.file("out/path_mis=false.exr").exists());

    // One bounce less is another picture, and the verdict says so; the reference is not made again.
    let kept = fs::read_dir(folder.file("kept")).unwrap().count();
    let json = compare("path,path:max_depth=1", "out2");
    assert_eq!(json["agreements"][0]["verdict"]["agrees"], false);
    assert_eq!((kept, fs::read_dir(folder.file("kept")).unwrap().count()), (1, 1));
}

#[test]
fn advise_recommends_one_method_and_objects_to_those_that_miss_light() {
    let folder = Folder::new();
    let mirror =
        SCENE.replace("Shape \"sphere\"", "Material \"conductor\" \"float roughness\" 0\nShape \"sphere\"");
    fs::write(folder.file("mirror.pbrt"), mirror).unwrap();
    let args = ["advise", "mirror.pbrt", "--integrators", "path,bdpt,light", "--pilot", "60ms", "--json"];
    let answer = steradian(folder.path(), &args);
    assert_eq!(answer.code, 0, "{}", answer.all());
    let advice = answer.json();
    let of = |label: &str| {
        advice
            .as_array()
            .unwrap()
            .iter()
            .find(|a| a["label"] == label)
            .unwrap_or_else(|| panic!("{label}"))
            .clone()
    };
    assert_eq!(advice.as_array().unwrap().iter().filter(|a| a["recommended"] == true).count(), 1);
    assert_eq!(advice[0]["recommended"], true, "the best comes first");
    assert!(of("light")["objection"].as_str().unwrap().contains("found more light"), "{advice}");
    assert!(of("path")["objection"].is_null() && of("bdpt")["objection"].is_null(), "{advice}");
    let seconds = |label: &str| of(label)["seconds"]["value"].as_f64().unwrap();
    assert!(seconds("path") > 0.0 && seconds("path").is_finite());
}
