//! Help, usage errors, exit statuses, and the commands that need no scene.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod common;

use std::fs;
use std::path::Path;

use common::steradian;
use film::{Film, FilmSettings, Filter, RenderKey};
use image::{Image, SaveOptions};
use tempfile::tempdir;

fn here(args: &[&str]) -> common::Answer {
    steradian(tempdir().unwrap().path(), args)
}

#[test]
fn help_is_what_the_contract_says() {
    insta::assert_snapshot!("help", here(&["--help"]).all());
    for command in
        ["render", "merge", "info", "integrators", "diff", "compare", "lab", "advise", "bench", "replay"]
    {
        let answer = here(&[command, "--help"]);
        assert_eq!(answer.code, 0);
        insta::assert_snapshot!(format!("help-{command}"), answer.stdout);
    }
}

#[test]
fn what_is_not_there_yet_is_not_in_the_help() {
    let help = here(&["--help"]).stdout + &here(&["render", "--help"]).stdout;
    for word in ["view", "--denoise"] {
        assert!(!help.contains(word), "{word}");
    }
}

#[test]
fn bad_usage_is_status_2_and_says_what_was_expected() {
    let wrong: [(&[&str], &str); 15] = [
        (&[], "Usage"),
        (&["paint"], "paint"),
        (&["render"], "SCENE"),
        (&["render", "a.pbrt", "--spp", "0"], "0 is not in 1.."),
        (&["render", "a.pbrt", "--spp", "4", "--time", "3s"], "cannot be used with"),
        (&["render", "a.pbrt", "--time", "soon"], "30s, 2m or 1.5h"),
        (&["render", "a.pbrt", "--passes", "8..4"], "A below B"),
        (&["render", "a.pbrt", "--resolution", "0x10"], "640x360"),
        (&["render", "a.pbrt", "--crop", "9,9,3,3"], "X0 must be below X1"),
        (&["render", "a.pbrt", "--set", "depth"], "NAME=VALUE"),
        (&["render", "a.pbrt", "--resume"], "--checkpoint"),
        (&["render", "a.pbrt", "--error", "0%"], "1% or 0.01"),
        (&["compare", "a.pbrt", "--integrators", "path:mis", "-o", "x"], "NAME:KEY=VALUE"),
        (&["lab", "alchemy"], "there is no experiment `alchemy`"),
        (&["diff", "a.exr", "b.exr", "--fail-above", "psnr=3"], "there is no metric `psnr`"),
    ];
    for (args, expected) in wrong {
        let answer = here(args);
        assert_eq!(answer.code, 2, "{args:?}\n{}", answer.all());
        assert!(answer.stderr.contains(expected), "{args:?}\n{}", answer.all());
        assert!(answer.stdout.is_empty());
    }
}

#[test]
fn a_scene_that_is_not_there_is_status_2_without_output() {
    let folder = tempdir().unwrap();
    let answer = steradian(folder.path(), &["render", "no.pbrt", "-o", "a.exr", "--json"]);
    insta::assert_snapshot!("no-scene", answer.all());
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn outputs_are_checked_before_the_scene_is_read() {
    let folder = tempdir().unwrap();
    fs::create_dir(folder.path().join("d.png")).unwrap();
    for (output, code, sentence) in [
        ("missing/a.exr", 1, "there is no folder missing"),
        ("d.png", 1, "it is a folder"),
        ("a.jpg", 2, "the endings .exr, .png, .hdr and .pfm are known"),
        ("a", 2, "the endings"),
    ] {
        let answer = steradian(folder.path(), &["render", "no.pbrt", "-o", output]);
        assert_eq!(answer.code, code, "{}", answer.all());
        assert!(answer.stderr.contains(sentence), "{}", answer.all());
        assert!(!answer.stderr.contains("no.pbrt"));
    }
    for option in ["--partial", "--checkpoint"] {
        let answer = steradian(folder.path(), &["render", "no.pbrt", option, "missing/f"]);
        assert_eq!(answer.code, 1, "{}", answer.all());
    }
}

fn grey(folder: &Path, name: &str, size: [usize; 2], value: f32) {
    let mut picture = Image::new(size[0], size[1], &["R", "G", "B"]);
    picture.data_mut().fill(value);
    image::save(&folder.join(name), &picture, &SaveOptions::default()).unwrap();
}

#[test]
fn diff_gives_metrics_and_statuses() {
    let folder = tempdir().unwrap();
    let folder = folder.path();
    grey(folder, "one.exr", [8, 4], 1.0);
    grey(folder, "half.pfm", [8, 4], 0.5);
    grey(folder, "small.exr", [4, 4], 1.0);
    grey(folder, "nan.exr", [8, 4], f32::NAN);

    let answer = steradian(folder, &["diff", "half.pfm", "one.exr", "--json"]);
    let json = answer.json();
    assert_eq!(answer.code, 0);
    assert_eq!(json["mse"], 0.25);
    assert!((json["relmse"].as_f64().unwrap() - 0.25 / 1.01).abs() < 1e-12);
    assert!((json["mape"].as_f64().unwrap() - 0.5 / 1.01).abs() < 1e-12);
    assert!((json["smape"].as_f64().unwrap() - 1.0 / 1.51).abs() < 1e-12);
    assert!((json["trimmed_relmse"].as_f64().unwrap() - 0.25 / 1.01).abs() < 1e-12);
    insta::assert_snapshot!("diff", steradian(folder, &["diff", "half.pfm", "one.exr"]).all());

    let limit =
        |metric, picture| steradian(folder, &["diff", picture, "one.exr", "--fail-above", metric]).code;
    assert_eq!([limit("mse=0.2", "half.pfm"), limit("mse=0.3", "half.pfm")], [1, 0]);
    assert_eq!([limit("mse=1", "nan.exr"), limit("relMSE=1", "one.exr")], [1, 0]);
    insta::assert_snapshot!("diff-size", steradian(folder, &["diff", "small.exr", "one.exr"]).all());
    insta::assert_snapshot!("diff-missing", steradian(folder, &["diff", "none.exr", "one.exr"]).all());
}

fn partial(folder: &Path, name: &str, passes: std::ops::Range<u32>, seed: u64) {
    let key = RenderKey { scene: "s".into(), integrator: "path".into(), settings: String::new(), seed };
    let film = Film::new(FilmSettings { key, ..FilmSettings::new([4, 3], Filter::gaussian()) }).unwrap();
    let mut buffer = film.pass_buffer().unwrap();
    let mut tile = film.tile();
    for pass in passes {
        buffer.begin(pass);
        tile.begin(film.settings().sample_bounds(), pass);
        tile.add_sample([1, 1], [0.5, 0.5], [1.0, pass as f32, 0.25]);
        buffer.add_tile(&tile);
        film.add_pass(&mut buffer).unwrap();
    }
    film.save(folder.join(name)).unwrap();
}

#[test]
fn merge_is_exact_and_refuses_what_does_not_belong_together() {
    let folder = tempdir().unwrap();
    let folder = folder.path();
    partial(folder, "all", 0..6, 1);
    partial(folder, "a", 0..2, 1);
    partial(folder, "b", 2..6, 1);
    partial(folder, "c", 1..3, 1);
    partial(folder, "other", 2..4, 2);

    let answer = steradian(folder, &["merge", "b", "a", "-o", "ab", "-o", "ab.exr", "--json"]);
    assert_eq!(answer.code, 0, "{}", answer.all());
    assert_eq!(answer.json()["spp"], 6);
    assert_eq!(fs::read(folder.join("ab")).unwrap(), fs::read(folder.join("all")).unwrap());
    steradian(folder, &["merge", "all", "-o", "all.exr"]);
    assert_eq!(fs::read(folder.join("ab.exr")).unwrap(), fs::read(folder.join("all.exr")).unwrap());

    let twice = steradian(folder, &["merge", "a", "a", "-o", "aa"]);
    assert_eq!(fs::read(folder.join("aa")).unwrap(), fs::read(folder.join("a")).unwrap());
    insta::assert_snapshot!("merge-twice", twice.all());
    insta::assert_snapshot!("merge-overlap", steradian(folder, &["merge", "a", "c", "-o", "x"]).all());
    insta::assert_snapshot!("merge-other", steradian(folder, &["merge", "a", "other", "-o", "x"]).all());
    let mut bytes = fs::read(folder.join("a")).unwrap();
    let middle = bytes.len() - 200;
    bytes[middle] ^= 1;
    fs::write(folder.join("damaged"), bytes).unwrap();
    insta::assert_snapshot!("merge-damaged", steradian(folder, &["merge", "damaged", "-o", "x"]).all());
    assert!(!folder.join("x").exists());
}

#[test]
fn integrators_are_listed_with_parameters() {
    let json = here(&["integrators", "--json"]).json();
    let list = json["integrators"].as_array().unwrap();
    let text = here(&["integrators"]).stdout;
    for i in list {
        assert!(text.contains(i["name"].as_str().unwrap()));
        for key in ["purpose", "misses", "unbiased", "parameters"] {
            assert!(!i[key].is_null(), "{key}");
        }
        for p in i["parameters"].as_array().unwrap() {
            assert!(p["default"].is_string() && p["doc"].is_string());
        }
    }
}
