//! Accidents: kills at any moment, full disks, folders that nobody may write to, checkpoints of something else.
#![cfg(unix)]
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod common;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

use common::{Answer, answer, steradian};
use film::{Film, FilmSettings};
use tempfile::{TempDir, tempdir};

/// A floor under a lamp.
const SCENE: &str = r#"
Film "rgb" "integer xresolution" 16 "integer yresolution" 12
Sampler "zsobol" "integer pixelsamples" 4
Integrator "path" "integer maxdepth" 2
LookAt 0 -4 2  0 0 0.5  0 0 1
Camera "perspective" "float fov" 45
WorldBegin
Shape "trianglemesh" "point3 P" [-3 -3 0  3 -3 0  3 3 0  -3 3 0] "integer indices" [0 1 2 0 2 3]
AttributeBegin
  AreaLightSource "diffuse" "rgb L" [5 5 5]
  Translate 0 0 3
  ReverseOrientation
  Shape "disk" "float radius" 1
AttributeEnd
"#;

fn folder() -> TempDir {
    let folder = tempdir().unwrap();
    fs::write(folder.path().join("s.pbrt"), SCENE).unwrap();
    folder
}

fn render(folder: &Path, args: &[&str]) -> Answer {
    steradian(folder, &[&["render", "s.pbrt"], args].concat())
}

fn rendered(folder: &Path, args: &[&str]) -> Answer {
    let answer = render(folder, args);
    assert_eq!(answer.code, 0, "{args:?}\n{}", answer.all());
    answer
}

/// A fixed sequence of numbers below `n`.
fn numbers(n: u64) -> impl Iterator<Item = u64> {
    (1_u64..).map(move |i| (i.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 33) % n)
}

/// Whatever moment a kill hits (reading, rendering, writing the checkpoint, renaming it), the checkpoint is whole, no pass that it
/// had is lost, and what comes out at last is the render that nobody disturbed.
#[test]
fn a_hundred_kills_at_random_moments_cost_nothing_that_was_saved() {
    let folder = folder();
    let path = folder.path();
    let saved = ["--checkpoint", "c", "--checkpoint-every", "2ms", "--resume", "-o", "x.exr"];
    let mut had = 0;
    for millis in numbers(60).take(100) {
        let mut child = Command::new(env!("CARGO_BIN_EXE_steradian"))
            .args(["render", "s.pbrt", "--spp", "100000000", "--threads", "1"])
            .args(saved)
            .current_dir(path)
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        std::thread::sleep(Duration::from_millis(5 + millis));
        child.kill().unwrap();
        child.wait().unwrap();
        if path.join("c").exists() {
            let passes = Film::load(path.join("c")).unwrap().passes().len();
            assert!(passes >= had, "{passes} passes after {had}");
            had = passes;
        }
    }
    assert!(had > 0 && !path.join("x.exr").exists());

    let spp = (had + 3).to_string();
    let json = rendered(path, &[&saved[..], &["--spp", &spp, "--json"]].concat()).json();
    assert_eq!(json["passes_resumed"].as_u64(), Some(had));
    rendered(path, &["--spp", &spp, "-o", "undisturbed.exr", "--partial", "undisturbed"]);
    let bytes = |name: &str| fs::read(path.join(name)).unwrap();
    assert!(bytes("x.exr") == bytes("undisturbed.exr"));
    assert!(bytes("c") == bytes("undisturbed"), "the film itself, too");
    let names: Vec<_> = fs::read_dir(path).unwrap().map(|e| e.unwrap().file_name()).collect();
    assert_eq!(names.len(), 5, "nothing is left behind: {names:?}");
}

#[test]
fn a_full_disk_leaves_the_old_checkpoint_and_says_so() {
    let folder = folder();
    let path = folder.path();
    let size = ["--resolution", "96x72", "--checkpoint", "c", "--resume"];
    rendered(path, &[&size[..], &["--spp", "2", "-o", "a.exr"]].concat());
    let before = fs::read(path.join("c")).unwrap();

    // No file may grow beyond 400 KiB: the picture does not, the checkpoint would.
    assert!(before.len() > (1 << 20), "{}", before.len());
    let line = r#"trap '' XFSZ; ulimit -f 400; exec "$0" "$@""#;
    let output = Command::new("bash")
        .args(["-c", line, env!("CARGO_BIN_EXE_steradian"), "render", "s.pbrt"])
        .args(size)
        .args(["--spp", "4", "-o", "b.exr", "--checkpoint-every", "1ms"])
        .current_dir(path)
        .output()
        .unwrap();
    let answer = answer(&output);
    assert_eq!(answer.code, 1, "{}", answer.all());
    assert!(answer.stderr.contains("error: cannot write c"), "{}", answer.all());
    assert!(answer.stderr.contains("File too large"), "{}", answer.all());
    assert!(fs::read(path.join("c")).unwrap() == before, "the old one is as it was");
    rendered(path, &["--resolution", "96x72", "--spp", "4", "-o", "d.exr"]);
    assert!(fs::read(path.join("b.exr")).unwrap() == fs::read(path.join("d.exr")).unwrap());
    let json = rendered(path, &[&size[..], &["--spp", "4", "-o", "e.exr", "--json"]].concat()).json();
    assert_eq!(json["passes_resumed"], 2, "and can be gone on from");
}

/// A folder in which no file can be made, for root neither.
fn closed(folder: &Path) -> PathBuf {
    use std::os::unix::fs::PermissionsExt;
    let closed = folder.join("closed");
    fs::create_dir(&closed).unwrap();
    fs::set_permissions(&closed, fs::Permissions::from_mode(0o555)).unwrap();
    if fs::write(closed.join("x"), "").is_err() { closed } else { "/proc".into() }
}

#[test]
fn a_folder_that_may_not_be_written_to_is_told_before_the_render() {
    let folder = folder();
    let path = folder.path();
    let closed = closed(path);
    for option in ["--checkpoint", "--partial", "--events", "-o"] {
        let file = closed.join("c.exr");
        let answer = render(path, &["--spp", "100000000", option, file.to_str().unwrap()]);
        assert_eq!(answer.code, 1, "{option}: {}", answer.all());
        let sentence = format!("error: cannot write {}", file.display());
        assert!(answer.stderr.contains(&sentence), "{option}: {}", answer.all());
    }
}

#[test]
fn a_checkpoint_of_something_else_is_refused_by_name_and_stays() {
    let folder = folder();
    let path = folder.path();
    rendered(path, &["--spp", "2", "--checkpoint", "c", "-o", "a.exr"]);
    let film = Film::load(path.join("c")).unwrap();

    // Another version.
    let mut key = film.settings().key.clone();
    key.settings = key.settings.replace("version=", "version=0.");
    Film::new(FilmSettings { key, ..film.settings().clone() }).unwrap().save(path.join("old")).unwrap();
    let refused = |name: &str, words: &[&str], more: &[&str]| {
        let before = fs::read(path.join(name)).unwrap();
        let answer = render(path, &[&["--checkpoint", name, "--resume", "-o", "x.exr"], more].concat());
        assert_eq!(answer.code, 2, "{name}: {}", answer.all());
        for word in [&[&*format!("error: {name} cannot be resumed: ")], words].concat() {
            assert!(answer.stderr.contains(word), "{name}, `{word}`: {}", answer.all());
        }
        assert!(before == fs::read(path.join(name)).unwrap() && !path.join("x.exr").exists());
    };
    refused("old", &["settings", "version=0.0"], &[]);
    refused("c", &["integrators light and path"], &["--integrator", "light"]);
    refused("c", &["resolutions 8 x 8 and 16 x 12"], &["--resolution", "8x8"]);

    // Damaged, cut, empty, and no film at all.
    let bytes = fs::read(path.join("c")).unwrap();
    let mut flipped = bytes.clone();
    let at = flipped.len() - 100;
    flipped[at] ^= 4;
    fs::write(path.join("flipped"), flipped).unwrap();
    fs::write(path.join("cut"), &bytes[..bytes.len() / 2]).unwrap();
    fs::write(path.join("empty"), "").unwrap();
    for (name, word) in [("flipped", "checksum"), ("cut", "truncated"), ("empty", "truncated")] {
        refused(name, &[word], &[]);
    }

    // Another scene, at last: what there is would be lost.
    fs::write(path.join("s.pbrt"), SCENE.replace("[5 5 5]", "[5 5 6]")).unwrap();
    refused("c", &["scenes "], &[]);
}

/// The Python package has the cluster: without it a sentence says what to do. (With it: `python/tests/test_cluster.py`.)
#[test]
fn a_cluster_without_the_python_package_is_a_sentence() {
    let folder = folder();
    let on_cluster = |variable: &str, value: &str| {
        let output = Command::new(env!("CARGO_BIN_EXE_steradian"))
            .args(["render", "s.pbrt", "--cluster", "local", "-o", "x.exr"])
            .env_remove("STERADIAN_PYTHON")
            .env(variable, value)
            .current_dir(folder.path())
            .output()
            .unwrap();
        let answer = answer(&output);
        assert!(answer.code == 2 && answer.stdout.is_empty(), "{}", answer.all());
        assert!(answer.stderr.contains("pip install 'steradian[cluster]'"), "{}", answer.all());
        answer.stderr
    };
    assert!(on_cluster("PATH", "/nowhere").contains("needs Python and the package"));
    assert!(
        on_cluster("STERADIAN_PYTHON", "/bin/true").contains("/bin/true -m steradian._remote ended with")
    );
    let answer = render(folder.path(), &["--cluster", "local", "--time", "3s"]);
    assert!(answer.code == 2 && answer.stderr.contains("cannot be used with"), "{}", answer.all());
}

#[test]
fn events_are_lines_that_a_monitor_can_read() {
    let folder = folder();
    let more = ["--checkpoint", "c", "--checkpoint-every", "1ms", "-o", "x.exr"];
    rendered(folder.path(), &[&more[..], &["--spp", "400", "--events", "e.jsonl"]].concat());
    let text = fs::read_to_string(folder.path().join("e.jsonl")).unwrap();
    let lines: Vec<serde_json::Value> = text.lines().map(|l| serde_json::from_str(l).unwrap()).collect();
    let of = |kind: &str| lines.iter().filter(|l| l["event"] == kind).collect::<Vec<_>>();
    assert!(lines[0]["event"] == "start" && lines[0]["integrator"] == "path", "{text}");
    assert!(lines.last().unwrap() == &serde_json::json!({"event": "end", "spp": 400, "interrupted": false}));
    assert!(!of("checkpoint").is_empty() && of("checkpoint").iter().all(|c| c["path"] == "c"), "{text}");

    // The fields are those of the guide.
    let guide = include_str!("../../../docs/guide/farms.md");
    let table = guide.split("### Of a render on this machine").nth(1).unwrap();
    let table = table.split("###").next().unwrap();
    for line in &lines {
        let head = format!("| `{}` |", line["event"].as_str().unwrap());
        let row = table.lines().find(|r| r.starts_with(&head)).unwrap_or_else(|| panic!("{head}"));
        for field in line.as_object().unwrap().keys().filter(|k| *k != "event") {
            assert!(row.contains(&format!("`{field}`")), "{row}: {field}");
        }
    }
}
