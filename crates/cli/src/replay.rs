//! `steradian replay`: one path again, alone.

use film::BadKind;
use render::Job;
use serde::Serialize;

use crate::args::ReplayArgs;
use crate::exit::{Done, Status};
use crate::load;
use crate::messages;

#[derive(Debug, Serialize)]
struct Report {
    pixel: [i32; 2],
    pass: u32,
    seed: u64,
    integrator: String,
    rgb: [f32; 3],
    /// Null if the sample is good.
    bad: Option<&'static str>,
    rays: u64,
}

pub(crate) fn run(args: &ReplayArgs) -> Done {
    let workers = load::workers(&args.scene)?;
    let opened = load::open(&args.scene, &args.method.set, &workers)?;
    let mut job = Job::new(&opened.scene, &load::method(&args.method))?;
    let replayed = job.replay(args.pixel, args.pass)?;

    let key = &job.film().settings().key;
    let report = Report {
        pixel: args.pixel,
        pass: args.pass,
        seed: key.seed,
        integrator: key.integrator.clone(),
        rgb: replayed.rgb,
        bad: replayed.bad.map(kind),
        rays: replayed.counters.rays,
    };
    if args.json {
        messages::json(&report);
        return Ok(Status::Done);
    }
    let [x, y] = args.pixel;
    messages::say(&format!(
        "{} at pixel {x},{y} of pass {} with seed {}",
        key.integrator, args.pass, key.seed
    ));
    match report.bad {
        Some(bad) => messages::say(&format!("  bad: {bad}")),
        None => messages::say(&format!("  radiance {} {} {}", report.rgb[0], report.rgb[1], report.rgb[2])),
    }
    messages::say(&format!("  {} rays", report.rays));
    Ok(Status::Done)
}

/// What is wrong with a sample, in words.
pub(crate) fn kind(kind: BadKind) -> &'static str {
    match kind {
        BadKind::Nan => "not a number",
        BadKind::TooLarge => "infinite or too large",
        BadKind::Negative => "negative",
    }
}
