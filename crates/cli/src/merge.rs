//! `steradian merge`.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use film::{Film, Merged};
use render::Workers;
use serde::Serialize;

use crate::args::MergeArgs;
use crate::exit::{Done, Failure, Status};
use crate::messages;

#[derive(Debug, Serialize)]
struct Report {
    spp: u64,
    passes: String,
    dropped_samples: u64,
    mean: [f64; 3],
    relmse_estimate: f64,
    /// Partial films whose passes were all there already.
    duplicates: Vec<PathBuf>,
    outputs: Vec<PathBuf>,
}

pub(crate) fn run(args: &MergeArgs) -> Done {
    args.output.iter().try_for_each(|path| render::check_writable(path))?;
    let (film, duplicates) = merged(&args.partials)?;
    let workers = Workers::new(None)?;
    let developed = workers.install(|| film.develop());
    let mut outputs = args.output.clone();
    let mut sheet = None;
    for path in &args.output {
        if render::is_picture(path) {
            let picture = render::picture(&film.label(), &developed).map_err(Failure::failed)?;
            workers.install(|| render::save_picture(path, &picture, args.exposure))?;
            if sheet.is_none() {
                sheet = render::save_sheet(path, &picture, args.exposure)?;
            }
        } else {
            render::save_film(&film, path)?;
        }
    }

    outputs.extend(sheet);
    let report = Report {
        spp: film.passes().len(),
        passes: film.passes().to_string(),
        dropped_samples: film.bad_samples().count(),
        mean: developed.mean_rgb(),
        relmse_estimate: developed.relmse_estimate(),
        duplicates,
        outputs,
    };
    if args.json {
        messages::json(&report);
    } else {
        messages::say(&format!("{} passes ({})", report.spp, report.passes));
        report.outputs.iter().for_each(|path| messages::say(&format!("wrote {}", path.display())));
    }
    Ok(Status::Done)
}

/// All films as one; and those that added nothing. The order of the names does not matter.
fn merged(paths: &[PathBuf]) -> Result<(Film, Vec<PathBuf>), Failure> {
    let (first, rest) = paths.split_first().ok_or_else(|| Failure::input("nothing to merge"))?;
    let mut film = load(first)?;
    let mut duplicates = Vec::new();
    let mut seen = BTreeSet::from([first]);
    for path in rest {
        let merged = film.merge(&load(path)?).map_err(|e| {
            Failure::input(format!("{} cannot be merged with the others: {e}", path.display()))
        })?;
        match merged {
            Merged::Added => {}
            Merged::AlreadyThere => {
                let again =
                    if seen.contains(path) { "was named twice" } else { "has no passes that are new" };
                messages::warning(&format!("{} {again}; it is not added again", path.display()));
                duplicates.push(path.clone());
            }
        }
        seen.insert(path);
    }
    Ok((film, duplicates))
}

fn load(path: &Path) -> Result<Film, Failure> {
    // A file that cannot be read is the person's to mend, like one that is damaged.
    Film::load(path).map_err(|e| Failure::Input(e.into()))
}
