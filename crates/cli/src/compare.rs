//! `steradian compare`.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use lab::comparison::{self, Budget, Comparison, Plan, Step, Truth};
use render::Event;
use std::io::IsTerminal;

use crate::args::CompareArgs;
use crate::exit::{Done, Failure, Status};
use crate::interrupt::Interrupt;
use crate::{load, messages};

/// What each run may spend, if nothing is said.
const DEFAULT_TIME: Duration = Duration::from_secs(5);

pub(crate) fn run(args: &CompareArgs) -> Done {
    fs::create_dir_all(&args.output)
        .map_err(|e| Failure::input(format!("cannot make the folder {}: {e}", args.output.display())))?;
    render::check_writable(&args.output.join("report.html"))?;
    let truth = truth(args)?;
    let interrupt = Interrupt::install()?;
    let workers = load::workers(&args.scene)?;
    let opened = load::open(&args.scene, &[], &workers)?;
    let plan = Plan {
        entries: args.integrators.clone(),
        budget: args.spp.map_or(Budget::Time(args.time.unwrap_or(DEFAULT_TIME)), Budget::Samples),
        seeds: (0..u64::from(args.seeds)).map(|i| args.seed.wrapping_add(i)).collect(),
        truth,
    };

    // Compare.
    let teller = Teller::new(!args.quiet);
    interrupt.rendering();
    let mut on_step = |step: Step<'_>| teller.on(step);
    let compared = comparison::run(&plan, &opened.scene, &workers, &interrupt.cancel, &mut on_step);
    teller.end();
    let compared = compared.map_err(failure)?;

    // Save.
    let outputs = lab::save(&args.output, &title(&args.scene.scene), &command(), &compared)?;
    if args.json {
        messages::json(&compared);
    } else if !args.quiet {
        print(&compared);
        outputs.iter().for_each(|path| messages::say(&format!("wrote {}", path.display())));
    }
    let stopped = interrupt.cancel.urgency() > render::Urgency::None;
    Ok(if stopped { Status::Interrupted } else { Status::Done })
}

/// Whose doing it was.
pub(crate) fn failure(e: comparison::Error) -> Failure {
    if let comparison::Error::Render(e) = e {
        return e.into();
    }
    if matches!(e, comparison::Error::Interrupted) { Failure::failed(e) } else { Failure::input(e) }
}

fn truth(args: &CompareArgs) -> Result<Truth, Failure> {
    if let Some(path) = &args.reference {
        let picture = lab::Picture::load(path).map_err(Failure::input)?;
        let name = path.display().to_string();
        return Ok(Truth::Picture { name, rgb: picture.rgb, variance: picture.variance });
    }
    Ok(Truth::Render {
        method: args.reference_integrator.method.clone(),
        relmse: args.reference_error,
        time: args.reference_time,
        cache: cache(args.cache.as_deref()),
    })
}

/// The folder that keeps references, made if need be.
pub(crate) fn cache(wanted: Option<&Path>) -> Option<PathBuf> {
    let folder = wanted.map(Path::to_path_buf).or_else(user_cache)?;
    match fs::create_dir_all(&folder) {
        Ok(()) => Some(folder),
        Err(e) => {
            messages::warning(&format!("references are not kept: cannot make {}: {e}", folder.display()));
            None
        }
    }
}

/// `$XDG_CACHE_HOME/steradian/references`, or the same in `~/.cache`.
#[must_use]
pub fn user_cache() -> Option<PathBuf> {
    let given = std::env::var_os("XDG_CACHE_HOME").filter(|v| !v.is_empty()).map(PathBuf::from);
    let home = || std::env::var_os("HOME").filter(|v| !v.is_empty()).map(|h| PathBuf::from(h).join(".cache"));
    given.or_else(home).map(|cache| cache.join("steradian").join("references"))
}

/// Says which run is on.
pub(crate) struct Teller {
    bar: ProgressBar,
}

impl Teller {
    pub(crate) fn new(wanted: bool) -> Self {
        let bar = ProgressBar::new_spinner();
        if !wanted || !std::io::stderr().is_terminal() {
            bar.set_draw_target(ProgressDrawTarget::hidden());
        }
        bar.set_style(
            ProgressStyle::with_template("{spinner} {msg}")
                .unwrap_or_else(|_| ProgressStyle::default_spinner()),
        );
        Self { bar }
    }

    /// Shows what is on now.
    pub(crate) fn say(&self, text: &str) {
        self.bar.set_message(text.to_owned());
        self.bar.tick();
    }

    pub(crate) fn end(&self) {
        self.bar.finish_and_clear();
    }

    pub(crate) fn on(&self, step: Step<'_>) {
        match step {
            Step::Reference => self.bar.set_message("reference"),
            Step::Trial { label, number, of } => {
                self.bar.set_message(format!("run {number} of {of}: {label}"))
            }
            Step::Event(Event::Warning(text)) => self.bar.suspend(|| messages::warning(text)),
            Step::Event(_) => self.bar.tick(),
        }
    }
}

/// What a scene is called: its file's name, or its folder's if the file's says nothing.
fn title(scene: &Path) -> String {
    let name = |part: Option<&std::ffi::OsStr>| part.map(|s| s.to_string_lossy().into_owned());
    let own = name(scene.file_stem()).unwrap_or_default();
    match (own.as_str(), name(scene.parent().and_then(Path::file_name))) {
        ("scene" | "scene-v4" | "scene-v3" | "scene_v3" | "index", Some(folder)) => folder,
        _ => own,
    }
}

/// What was typed.
pub(crate) fn command() -> String {
    let quote = |a: String| if a.contains(' ') { format!("'{a}'") } else { a };
    let args = std::env::args_os().skip(1).map(|a| quote(a.to_string_lossy().into_owned()));
    std::iter::once("steradian".to_owned()).chain(args).collect::<Vec<_>>().join(" ")
}

fn print(compared: &Comparison) {
    let r = &compared.reference;
    let noise =
        r.relmse.map_or("of unknown noise".to_owned(), |n| format!("whose own relMSE is about {n:.1e}"));
    messages::say(&format!("reference: {}, {noise}", r.name));
    messages::say(&format!(
        "{:<24}{:>8}{:>9}{:>11}{:>11}{:>8}{:>13}{:>8}",
        "method", "spp", "seconds", "relMSE", "trimmed", "FLIP", "efficiency", "slope"
    ));
    for m in &compared.methods {
        let slope = m.slope.map_or("–".to_owned(), |s| format!("{:.2}", s.samples.value));
        messages::say(&format!(
            "{:<24}{:>8.0}{:>9.2}{:>11.2e}{:>11.2e}{:>8.3}{:>13.3e}{:>8}",
            m.label,
            m.spp,
            m.seconds,
            m.relmse.value,
            m.trimmed_relmse.value,
            m.flip,
            m.efficiency.value,
            slope
        ));
    }
    for a in &compared.agreements {
        let v = &a.verdict;
        let verdict = if v.agrees { "agree" } else { "differ" };
        messages::say(&format!(
            "{} and {} {verdict}: worst tile {},{}: |t| = {:.2}, p = {:.1e}, {:+.2} %",
            a.a,
            a.b,
            v.tile[0],
            v.tile[1],
            v.statistic,
            v.p_value,
            100.0 * v.difference
        ));
    }
}
