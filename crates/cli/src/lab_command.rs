//! `steradian lab`.

use std::fs;

use lab::experiment::{CATALOGUE, Effort, Experiment, Outcome, strip};

use crate::args::LabArgs;
use crate::compare::{self, Teller};
use crate::exit::{Done, Failure, Status};
use crate::interrupt::Interrupt;
use crate::messages;

pub(crate) fn run(args: &LabArgs) -> Done {
    if args.list {
        CATALOGUE.iter().for_each(|e| messages::say(&format!("{:<20}{}", e.name, e.title)));
        return Ok(Status::Done);
    }
    let wanted = wanted(args)?;
    if !(args.scale.is_finite() && args.scale > 0.0) {
        return Err(Failure::input(format!("--scale {} is no factor above zero", args.scale)));
    }
    if let Some(folder) = &args.output {
        fs::create_dir_all(folder)
            .map_err(|e| Failure::input(format!("cannot make the folder {}: {e}", folder.display())))?;
    }
    let interrupt = Interrupt::install()?;
    let workers = render::Workers::new(args.threads)?;
    let cache = compare::cache(args.cache.as_deref());
    let effort = Effort { seeds: args.seeds, scale: args.scale, reference_time: args.reference_time };
    interrupt.rendering();

    let mut outcomes = Vec::new();
    for experiment in wanted {
        let teller = Teller::new(!args.quiet);
        let mut on_step = |step: lab::comparison::Step<'_>| teller.on(step);
        let outcome = experiment.run(effort, cache.as_deref(), &workers, &interrupt.cancel, &mut on_step);
        teller.end();
        let outcome = outcome.map_err(compare::failure)?;
        tell(args, experiment, &outcome);
        save(args, experiment, &outcome)?;
        outcomes.push(outcome);
        if interrupt.cancel.urgency() > render::Urgency::None {
            return Ok(Status::Interrupted);
        }
    }
    if let Some(folder) = &args.output {
        let text = lecture(&outcomes);
        image::write_atomically(&folder.join("lecture.md"), text.as_bytes()).map_err(Failure::failed)?;
    }
    if args.json {
        messages::json(&outcomes);
    }
    Ok(if outcomes.iter().all(|o| o.passed) { Status::Done } else { Status::No })
}

fn wanted(args: &LabArgs) -> Result<Vec<&'static Experiment>, Failure> {
    if args.all {
        return Ok(CATALOGUE.iter().collect());
    }
    let find = |name: &String| {
        Experiment::find(name).ok_or_else(|| {
            let names: Vec<_> = CATALOGUE.iter().map(|e| e.name).collect();
            Failure::input(format!("there is no experiment `{name}`; there are {}", names.join(", ")))
        })
    };
    args.experiments.iter().map(find).collect()
}

fn tell(args: &LabArgs, experiment: &Experiment, outcome: &Outcome) {
    if args.quiet || args.json {
        return;
    }
    messages::say(&format!("{}: {}", experiment.name, if outcome.passed { "pass" } else { "FAIL" }));
    for finding in &outcome.findings {
        let sign = if finding.holds { "  ✓" } else { "  ✗" };
        messages::say(&format!("{sign} {}: {}", finding.claim, finding.measured));
    }
}

fn save(args: &LabArgs, experiment: &Experiment, outcome: &Outcome) -> Result<(), Failure> {
    let Some(folder) = &args.output else { return Ok(()) };
    let folder = folder.join(experiment.name);
    fs::create_dir_all(&folder).map_err(Failure::failed)?;
    lab::save(&folder, experiment.title, &compare::command(), &outcome.comparison)?;
    let sheet = strip(&outcome.comparison).map_err(Failure::failed)?;
    render::save_picture(&folder.join("pictures.png"), &sheet, 0.0)?;
    let pictures = args.output.iter().map(|o| o.join("lecture"));
    for of_lecture in pictures {
        fs::create_dir_all(&of_lecture).map_err(Failure::failed)?;
        render::save_picture(&of_lecture.join(format!("{}.png", experiment.name)), &sheet, 0.0)?;
    }
    let json = serde_json::to_string_pretty(&outcome.findings).map_err(Failure::failed)?;
    image::write_atomically(&folder.join("findings.json"), json.as_bytes()).map_err(Failure::failed)
}

/// The lecture of what was run: theory, pictures, and what was found.
fn lecture(outcomes: &[Outcome]) -> String {
    let mut text = "# The theory of light transport, checked\n\n\
        Written by `steradian lab --all -o DIR`: theory, pictures and findings of each experiment, in the order in which they build on each\n\
        other. Every claim is a statistical test; the tests of one experiment share a false-alarm rate of 1 %. Errors that are\n\
        compared are trimmed relMSE, without the worst thousandth of the pixels: single samples would decide relMSE of a few runs.\n\
        Pictures are the first run of each method, the reference last; `DIR/EXPERIMENT/report.html` has them to look into.\n"
        .to_owned();
    for outcome in outcomes {
        let Some(e) = Experiment::find(outcome.name) else { continue };
        let seeds = outcome.comparison.seeds.len();
        text += &format!(
            "\n## {}\n\n`steradian lab {}`: {}, {seeds} runs.\n\n",
            e.title, e.name, outcome.comparison.budget
        );
        text += &format!("{}\n\n![{}](lecture/{}.png)\n\n", e.theory, e.title, e.name);
        text += "| method | relMSE | trimmed | FLIP | rays per sample |\n|---|---|---|---|---|\n";
        let [w, h] = outcome.comparison.size;
        for m in &outcome.comparison.methods {
            let rays = m.mrays_per_run * 1e6 / (m.spp * (w * h) as f64);
            let [relmse, trimmed] = [m.relmse.value, m.trimmed_relmse.value];
            text += &format!("| {} | {relmse:.2e} | {trimmed:.2e} | {:.3} | {rays:.1} |\n", m.label, m.flip);
        }
        text.push('\n');
        for f in &outcome.findings {
            let sign = if f.holds { "holds" } else { "**does not hold**" };
            text += &format!("- {} – {sign}: {}.\n", f.claim, f.measured);
        }
    }
    text
}
