//! A render: a scene, a method with its settings, and the film that they fill.

use std::time::Duration;

use film::{BadKind, Film, FilmSettings, Filter, RenderKey, Sign};
use integrators::parameters::{ParameterInfo, ParameterKind};
use integrators::{Cell, CellOutput, Counters, Integrator, Making, PassContext, Prepared};
use math::Bounds2i;
use scene::Scene;
use scene_desc::{FilterDesc, IntegratorDesc, LightSelection, ParameterValue};

use crate::cells::TILE_SIDE;
use crate::checkpoint::{Checkpoint, save_film};
use crate::events::{Cancel, Event};
use crate::memory;
use crate::open::SCENE_SETTINGS;
use crate::output::VERSION;
use crate::run::{Checkpointer, Control, Passes, RunReport, Viewer, run};
use crate::stop::Stop;
use crate::{Error, Workers};

/// No filter reaches farther around the film, in pixels: [`film::Filter`]'s largest radius less the pixel's own half.
const FARTHEST_BORDER: u32 = 15;

/// What a caller wants otherwise than the scene's file.
#[derive(Clone, Debug, Default)]
pub struct Method {
    /// The integrator's name.
    pub integrator: Option<String>,
    /// Its parameters by name; a later one wins. (Those that [`SCENE_SETTINGS`] names are skipped: they were used when the scene
    /// was opened.)
    pub settings: Vec<(String, String)>,
    /// Seed of all randomness.
    pub seed: Option<u64>,
}

/// A scene, an integrator and a film.
pub struct Job<'s> {
    bound: Bound<'s>,
    film: Film,
    view: Option<View<'s>>,
}

/// Somebody who looks at the film while it is rendered.
struct View<'s> {
    every: Duration,
    show: Box<dyn FnMut(&Film) + 's>,
}

/// An integrator and its scene.
struct Bound<'s> {
    scene: &'s Scene,
    integrator: Box<dyn Integrator>,
}

impl Passes for Bound<'_> {
    fn prepares(&self) -> bool {
        self.integrator.prepares()
    }

    fn prepare(&mut self, pass: u32) -> Prepared {
        self.integrator.prepare(PassContext { scene: self.scene, pass })
    }

    fn light_blocks(&self) -> u32 {
        self.integrator.light_blocks(self.scene)
    }

    fn cell(&self, pass: u32, cell: Cell, out: &mut CellOutput) {
        self.integrator.cell(PassContext { scene: self.scene, pass }, cell, out);
    }
}

impl<'s> Job<'s> {
    /// Makes the integrator and an empty film.
    ///
    /// # Errors
    /// The integrator or a parameter does not exist, or there is no memory for the film.
    pub fn new(scene: &'s Scene, method: &Method) -> Result<Self, Error> {
        let (bound, settings) = bind(scene, method)?;
        memory::check(&settings, 2)?;
        Ok(Self { bound, film: Film::new(settings)?, view: None })
    }

    /// The method, on its scene.
    pub(crate) fn bound(&self) -> &(dyn Passes + 's) {
        &self.bound
    }

    /// What was rendered so far.
    #[must_use]
    pub fn film(&self) -> &Film {
        &self.film
    }

    /// From now on `show` sees the film `every` so often while it is rendered: whole passes, at least one. Workers go on meanwhile,
    /// but add nothing to the film.
    pub fn view(&mut self, every: Duration, show: impl FnMut(&Film) + 's) {
        self.view = Some(View { every, show: Box::new(show) });
    }

    /// Takes over what another render of the same scene and method has.
    ///
    /// # Errors
    /// It is a film of something else.
    pub fn merge(&mut self, film: &Film) -> Result<(), Error> {
        self.film.merge(film)?;
        Ok(())
    }

    /// What was rendered, for good.
    #[must_use]
    pub fn into_film(self) -> Film {
        self.film
    }

    /// Gives the film away and goes on with an empty one: passes that are rendered next can be looked at by themselves, and
    /// [`Film::merge`] adds them up again.
    ///
    /// # Errors
    /// There is no memory for another film.
    pub fn take_film(&mut self) -> Result<Film, Error> {
        let empty = Film::new(self.film.settings().clone())?;
        Ok(std::mem::replace(&mut self.film, empty))
    }

    /// The round that a pass reads of what was learned; see [`Integrator::round`].
    #[must_use]
    pub fn round(&self, pass: u32) -> Option<u32> {
        self.bound.integrator.round(PassContext { scene: self.bound.scene, pass })
    }

    /// Learns what a pass reads, without rendering it, as bytes for [`Job::take_learned`] in another process.
    pub fn learn(&mut self, pass: u32, workers: &Workers) -> (Option<Vec<u8>>, Prepared) {
        let prepared = workers.install(|| self.bound.prepare(pass));
        (self.bound.integrator.learned(), prepared)
    }

    /// Takes over what a job of the same scene and method has learned; the bits do not change. False if it is no such thing.
    pub fn take_learned(&mut self, bytes: &[u8]) -> bool {
        self.bound.integrator.take_learned(bytes)
    }

    /// Renders what `stop` asks for and the film does not have yet, with checkpoints if wanted.
    ///
    /// # Errors
    /// See [`run`]; also a checkpoint that does not fit.
    pub fn render(
        &mut self,
        stop: &Stop,
        checkpoint: Option<&Checkpoint>,
        workers: &Workers,
        cancel: &Cancel,
        on_event: &mut dyn FnMut(Event<'_>),
    ) -> Result<Outcome, Error> {
        let before = self.film.passes().len();
        if let Some(checkpoint) = checkpoint
            && let Some(film) = checkpoint.begin()?
        {
            self.film.merge(&film).map_err(|e| checkpoint.refused(&e))?;
        }
        let passes_resumed = self.film.passes().len() - before;

        let mut save = |film: &Film| match checkpoint {
            Some(checkpoint) => save_film(film, &checkpoint.path),
            None => Ok(()),
        };
        let checkpointer =
            checkpoint.map(|c| Checkpointer { path: &c.path, every: c.every, save: &mut save });
        let viewer = self.view.as_mut().map(|v| Viewer { every: v.every, show: &mut *v.show });
        let control = Control { cancel: cancel.clone(), checkpoint: checkpointer, viewer, on_event };
        let report = run(&mut self.bound, &self.film, stop, workers, control)?;

        // Once more at the end, so that a later call can go on from here.
        let checkpoint_error = if report.passes > 0 { save(&self.film).err() } else { None };
        Ok(Outcome { report, passes_resumed, checkpoint_error })
    }

    /// Walks one camera path again: what its pixel gives in a pass. The pixel may lie in the filter's border around the film.
    /// A film of this job is not changed.
    ///
    /// # Errors
    /// The pixel is too far outside, or there is no memory.
    pub fn replay(&mut self, pixel: [i32; 2], pass: u32) -> Result<Replayed, Error> {
        // A film of the one pixel that is nearest, and a filter wide enough to see the sample.
        let settings = self.film.settings();
        let inside = [0, 1].map(|a| pixel[a].clamp(0, settings.resolution[a] as i32 - 1));
        let far = (0..2).map(|a| inside[a].abs_diff(pixel[a])).max().unwrap_or(0);
        if far > FARTHEST_BORDER {
            let [width, height] = settings.resolution;
            return Err(Error::Pixel { at: pixel, width, height });
        }
        let filter = match far {
            0 => Filter::pixel_box(),
            _ => Filter::Box { radius: [far as f32 + 1.0; 2] },
        };
        let crop = Bounds2i::new(inside, inside.map(|x| x + 1));
        let film = Film::new(FilmSettings { crop, filter, ..settings.clone() })?;

        let mut out =
            CellOutput { tile: film.tile(), splats: film.splat_list(), counters: Counters::default() };
        let tile = Bounds2i::new(pixel, pixel.map(|x| x.saturating_add(1)));
        out.tile.begin(tile, pass);
        out.splats.begin(pass);
        if self.bound.prepares() {
            self.bound.prepare(pass);
        }
        self.bound.cell(pass, Cell::Tile(tile), &mut out);

        let mut buffer = film.pass_buffer()?;
        buffer.begin(pass);
        buffer.add_tile(&out.tile);
        film.add_pass(&mut buffer)?;
        let rgb = film.develop().mean.first().copied().unwrap_or_default();
        let bad = out.tile.bad_samples().first().next().map(|b| b.kind);
        Ok(Replayed { rgb, bad, counters: out.counters })
    }
}

/// What a render did.
#[derive(Debug)]
pub struct Outcome {
    /// What this run did.
    pub report: RunReport,
    /// Passes that came from the checkpoint.
    pub passes_resumed: u64,
    /// Why the last checkpoint was not written. The film is complete all the same.
    pub checkpoint_error: Option<Error>,
}

impl Outcome {
    /// This run and then another one of the same job.
    pub(crate) fn and(self, next: Self) -> Self {
        let mut counters = self.report.counters;
        counters.add(&next.report.counters);
        let report = RunReport {
            passes: self.report.passes + next.report.passes,
            elapsed: self.report.elapsed + next.report.elapsed,
            counters,
            cancelled: next.report.cancelled,
        };
        Self { report, passes_resumed: self.passes_resumed, checkpoint_error: next.checkpoint_error }
    }
}

/// A path that was walked again.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Replayed {
    /// Its radiance; zero if it is bad.
    pub rgb: [f32; 3],
    /// What is wrong with it.
    pub bad: Option<BadKind>,
    /// What was done for it.
    pub counters: Counters,
}

/// The integrator, and what its film is a film of.
fn bind<'s>(scene: &'s Scene, method: &Method) -> Result<(Bound<'s>, FilmSettings), Error> {
    let of_scene = scene.settings();
    let name = method.integrator.as_deref().unwrap_or(&of_scene.integrator.name);
    let seed = method.seed.unwrap_or(of_scene.sampler.seed);
    let infos = (integrators::find(name)?.parameters)();
    let given = parameters(name, &infos, &of_scene.integrator, &method.settings);
    let making = Making { scene, sampler: &of_scene.sampler, seed };
    let (integrator, canonical) =
        integrators::create(name, given.iter().map(|(k, v)| (k.as_str(), v)), &making)?;

    let mode = if of_scene.spectral { "spectral" } else { "rgb" };
    let [sx, sy] = of_scene.sampler.strata;
    let sampler = match of_scene.sampler.name.as_str() {
        "stratified" => format!("stratified({sx}x{sy})"),
        other => other.to_owned(),
    };
    let lights = match of_scene.integrator.light_selection {
        LightSelection::Uniform => "uniform",
        LightSelection::Power => "power",
        LightSelection::Spatial => "spatial",
    };
    let shared =
        format!("light_selection={lights} mode={mode} sampler={sampler} tile={TILE_SIDE} version={VERSION}");
    let integrators::Channels { samples, splats } = integrator.channels();
    let settings = FilmSettings {
        crop: of_scene.crop,
        sign: if of_scene.spectral { Sign::Any } else { Sign::NonNegative },
        splats: integrator.splats(),
        aovs: samples,
        splat_aovs: splats,
        iterations: integrator.iterations(scene),
        key: RenderKey {
            scene: format!("{:016x}", of_scene.content_hash),
            integrator: name.to_owned(),
            settings: format!("{canonical} {shared}").trim_start().to_owned(),
            seed,
        },
        ..FilmSettings::new(of_scene.resolution, filter(&of_scene.filter))
    };
    Ok((Bound { scene, integrator }, settings))
}

/// The integrator's parameters, in the order in which later ones win: depth limits from the file whatever its method, what else
/// the file says if the method is its own, then the caller's.
fn parameters(
    name: &str,
    infos: &[ParameterInfo],
    of_file: &IntegratorDesc,
    of_caller: &[(String, String)],
) -> Vec<(String, ParameterValue)> {
    let mut given = Vec::new();
    let unlimited = || ParameterValue::Text("none".to_owned());
    let number = |n: u32| ParameterValue::Integer(i64::from(n));
    for info in infos {
        match (info.name, &info.kind) {
            ("max_depth", ParameterKind::Limit(_)) => {
                given.push((info.name.to_owned(), of_file.max_depth.map_or_else(unlimited, number)));
            }
            ("rr_depth", _) => given.extend(of_file.rr_depth.map(|n| (info.name.to_owned(), number(n)))),
            _ => {}
        }
    }
    if name == of_file.name {
        given.extend(of_file.parameters.iter().map(|(k, v)| (k.clone(), v.clone())));
    }
    let own = of_caller.iter().filter(|(k, _)| !SCENE_SETTINGS.contains(&k.as_str()));
    given.extend(own.map(|(k, v)| (k.clone(), ParameterValue::Text(v.clone()))));
    given
}

fn filter(desc: &FilterDesc) -> Filter {
    match *desc {
        FilterDesc::Box { radius } => Filter::Box { radius },
        FilterDesc::Triangle { radius } => Filter::Triangle { radius },
        FilterDesc::Gaussian { radius, sigma } => Filter::Gaussian { radius, sigma },
        FilterDesc::Mitchell { radius, b, c } => Filter::Mitchell { radius, b, c },
        FilterDesc::Sinc { radius, tau } => Filter::Sinc { radius, tau },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn infos() -> Vec<ParameterInfo> {
        vec![
            ParameterInfo { name: "max_depth", kind: ParameterKind::Limit(Some(5)), doc: "" },
            ParameterInfo { name: "rr_depth", kind: ParameterKind::Integer(3), doc: "" },
            ParameterInfo { name: "mis", kind: ParameterKind::Bool(true), doc: "" },
        ]
    }

    fn of_file() -> IntegratorDesc {
        IntegratorDesc {
            max_depth: None,
            rr_depth: Some(7),
            parameters: [("mis".to_owned(), ParameterValue::Bool(false))].into(),
            ..IntegratorDesc::default()
        }
    }

    fn names(given: &[(String, ParameterValue)]) -> Vec<&str> {
        given.iter().map(|(k, _)| k.as_str()).collect()
    }

    #[test]
    fn another_method_keeps_the_files_depths_but_not_its_own_parameters() {
        let given = parameters("bdpt", &infos(), &of_file(), &[]);
        assert_eq!(names(&given), ["max_depth", "rr_depth"]);
        assert_eq!(given[0].1, ParameterValue::Text("none".into()));
        assert_eq!(given[1].1, ParameterValue::Integer(7));
    }

    #[test]
    fn the_caller_wins() {
        let set = [("max_depth".to_owned(), "2".to_owned()), ("sampler".to_owned(), "sobol".to_owned())];
        let given = parameters("path", &infos(), &of_file(), &set);
        assert_eq!(names(&given), ["max_depth", "rr_depth", "mis", "max_depth"]);
        assert_eq!(given[3].1, ParameterValue::Text("2".into()));
    }

    #[test]
    fn a_method_without_depths_gets_none() {
        assert!(parameters("ao", &[], &of_file(), &[]).is_empty());
    }
}
