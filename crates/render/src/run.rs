//! The run: workers take tasks from the schedule, this thread watches the clock, the person and the checkpoint.
//!
//! A worker owns what it writes to (a tile, a list of splats) and keeps it for all its cells: nothing is allocated per cell.
//! The one lock that all share is taken twice per task, that is per some thousand paths.

use std::ops::Range;
use std::path::Path;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError, RwLock};
use std::time::Duration;

use film::{Film, PassBuffer};
use integrators::{Cell, CellOutput, Counters, Prepared};

use crate::cells;
use crate::events::{Cancel, Event};
use crate::schedule::{Schedule, Shape, Task};
use crate::stop::{PassList, Stop};
use crate::watch::Watch;
use crate::{Error, Workers};

/// What is rendered, pass by pass: an integrator and its scene.
pub trait Passes: Send + Sync {
    /// Does a pass need [`Passes::prepare`]?
    fn prepares(&self) -> bool;

    /// Builds what the pass reads.
    fn prepare(&mut self, pass: u32) -> Prepared;

    /// Blocks of light paths in a pass.
    fn light_blocks(&self) -> u32;

    /// Renders a cell into `out`, which was made ready for it: a pure function of pass and cell.
    fn cell(&self, pass: u32, cell: Cell, out: &mut CellOutput);
}

/// What a run is told from outside.
pub struct Control<'a> {
    /// Stops it.
    pub cancel: Cancel,
    /// Saves the film every so often; an error is a warning, for the render is worth more than its checkpoint.
    pub checkpoint: Option<Checkpointer<'a>>,
    /// Looks at the film every so often.
    pub viewer: Option<Viewer<'a>>,
    /// Hears how it goes.
    pub on_event: &'a mut dyn FnMut(Event<'_>),
}

/// Saves a film while it is rendered.
pub struct Checkpointer<'a> {
    /// Where, for events.
    pub path: &'a Path,
    /// How often.
    pub every: Duration,
    /// How. The film does not change meanwhile.
    pub save: &'a mut dyn FnMut(&Film) -> Result<(), Error>,
}

/// Looks at a film while it is rendered.
pub struct Viewer<'a> {
    /// How often.
    pub every: Duration,
    /// How. The film does not change meanwhile; it has at least one pass.
    pub show: &'a mut dyn FnMut(&Film),
}

/// What a run did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RunReport {
    /// Passes that were added to the film.
    pub passes: u32,
    /// Time from the first sample on.
    pub elapsed: Duration,
    /// What was done for those passes.
    pub counters: Counters,
    /// Was it stopped by [`Cancel`] before it was done?
    pub cancelled: bool,
}

/// Renders into `film` the passes that `stop` asks for and that it does not have. The film's bits do not depend on `workers`, nor
/// on how passes are split over calls.
///
/// # Errors
/// No memory or no threads.
pub fn run(
    passes: &mut dyn Passes,
    film: &Film,
    stop: &Stop,
    workers: &Workers,
    control: Control<'_>,
) -> Result<RunReport, Error> {
    let list = PassList::new(stop, &film.passes());
    let cells = cells::of_pass(film.settings().sample_bounds(), passes.light_blocks());
    let shape = Shape {
        n_cells: cells.len(),
        n_blocks: film.n_blocks(),
        window: window(cells.len(), workers.len()),
        sequential: passes.prepares(),
    };
    let buffers = (0..shape.window).map(|_| film.pass_buffer().map(RwLock::new)).collect::<Result<_, _>>()?;
    let schedule = Schedule::new(shape, list.len());
    let shared = Shared {
        film,
        cells,
        workers,
        buffers,
        schedule: Mutex::new(State { schedule, panicked: false, error: None, warnings: Vec::new() }),
        list,
        passes: RwLock::new(passes),
        work: Condvar::new(),
        news: Condvar::new(),
    };
    let watch = Watch::new(&shared, stop, control);
    workers.run(|| shared.worker(), || watch.until_done())?
}

/// Passes in the works at a time: two, so that nobody waits for the last cell of a pass; more if passes are tiny.
fn window(n_cells: usize, n_workers: usize) -> u32 {
    let wanted = 2 + 2 * n_workers / n_cells.max(1);
    u32::try_from(wanted.min(64)).unwrap_or(64)
}

/// What workers and watch share.
pub(crate) struct Shared<'a> {
    pub(crate) film: &'a Film,
    pub(crate) cells: Vec<Cell>,
    pub(crate) workers: &'a Workers,
    /// Pass `i` uses buffer `i % window`. Written when a pass opens, when nobody else has it.
    pub(crate) buffers: Vec<RwLock<PassBuffer>>,
    pub(crate) schedule: Mutex<State>,
    pub(crate) list: PassList,
    /// Written by `prepare` alone.
    pub(crate) passes: RwLock<&'a mut dyn Passes>,
    /// There may be work again.
    pub(crate) work: Condvar,
    /// The schedule got on.
    pub(crate) news: Condvar,
}

pub(crate) struct State {
    pub(crate) schedule: Schedule,
    pub(crate) panicked: bool,
    pub(crate) error: Option<film::Error>,
    /// What was not told yet.
    pub(crate) warnings: Vec<String>,
}

impl State {
    /// Is nothing left to do, or to hope for?
    pub(crate) fn is_over(&self) -> bool {
        self.panicked || self.schedule.folded() == self.schedule.end()
    }
}

impl Shared<'_> {
    pub(crate) fn lock(&self) -> MutexGuard<'_, State> {
        self.schedule.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn worker(&self) {
        let _guard = PanicGuard(self);
        let mut out = CellOutput {
            tile: self.film.tile(),
            splats: self.film.splat_list(),
            counters: Counters::default(),
        };
        let mut state = self.lock();
        loop {
            match state.schedule.next_task() {
                Task::Exit => return,
                Task::Wait => state = self.work.wait(state).unwrap_or_else(PoisonError::into_inner),
                task @ (Task::Open(_) | Task::Cell(..) | Task::Fold(..)) => {
                    drop(state);
                    out.counters = Counters::default();
                    self.perform(&task, &mut out);
                    state = self.lock();
                    self.close(&task, &mut state);
                    if state.schedule.finish(&task, &out.counters) {
                        self.work.notify_all();
                        self.news.notify_all();
                    }
                }
            }
        }
    }

    fn perform(&self, task: &Task, out: &mut CellOutput) {
        match task {
            Task::Open(i) => self.open(*i, &mut out.counters),
            Task::Cell(i, cell) => self.cell(*i, self.cells[*cell], out),
            Task::Fold(i, blocks) => self.fold(*i, blocks.clone()),
            Task::Wait | Task::Exit => {}
        }
    }

    fn buffer(&self, i: u32) -> &RwLock<PassBuffer> {
        &self.buffers[i as usize % self.buffers.len()]
    }

    fn open(&self, i: u32, counters: &mut Counters) {
        let pass = self.list.number(i);
        self.buffer(i).write().unwrap_or_else(PoisonError::into_inner).begin(pass);
        let prepares = self.passes.read().unwrap_or_else(PoisonError::into_inner).prepares();
        if prepares && !self.lock().schedule.is_prepared(i) {
            let mut guard = self.passes.write().unwrap_or_else(PoisonError::into_inner);
            let passes: &mut dyn Passes = &mut **guard;
            let prepared = self.workers.install(|| passes.prepare(pass));
            drop(guard);
            *counters = prepared.counters;
            let mut state = self.lock();
            state.schedule.prepare_until(self.list.before(prepared.until).max(i + 1));
            state.warnings.extend(prepared.warning);
        }
    }

    fn cell(&self, i: u32, cell: Cell, out: &mut CellOutput) {
        let pass = self.list.number(i);
        out.splats.begin(pass);
        let bounds = match cell {
            Cell::Tile(bounds) => bounds,
            Cell::LightBlock(_) => math::Bounds2i::new([0, 0], [0, 0]),
        };
        out.tile.begin(bounds, pass);
        self.passes.read().unwrap_or_else(PoisonError::into_inner).cell(pass, cell, out);

        let buffer = self.buffer(i).read().unwrap_or_else(PoisonError::into_inner);
        match cell {
            Cell::Tile(_) => buffer.add_tile(&out.tile),
            Cell::LightBlock(_) => {}
        }
        buffer.add_splats(&mut out.splats);
    }

    /// Folds blocks of a complete pass. Whoever has the first ones opens it in the film.
    fn fold(&self, i: u32, blocks: Range<usize>) {
        let buffer = self.buffer(i).read().unwrap_or_else(PoisonError::into_inner);
        if blocks.start == 0
            && let Err(e) = self.film.begin_pass(buffer.pass())
        {
            self.lock().error = Some(e);
        }
        for block in blocks {
            self.film.add_pass_block(&buffer, block);
        }
    }

    /// After the last blocks of a pass, it is complete in the film.
    fn close(&self, task: &Task, state: &mut State) {
        let Task::Fold(i, blocks) = task else { return };
        if !state.schedule.is_last_fold(blocks.len()) {
            return;
        }
        let buffer = self.buffer(*i).read().unwrap_or_else(PoisonError::into_inner);
        self.film.take_bad_samples(&buffer);
        if let Err(e) = self.film.end_pass(buffer.pass()) {
            state.error.get_or_insert(e);
        }
        if state.error.is_some() {
            state.schedule.abort();
        }
    }
}

/// Tells the others when a worker panics, so that they end too.
struct PanicGuard<'a, 's>(&'a Shared<'s>);

impl Drop for PanicGuard<'_, '_> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            let mut state = self.0.lock();
            state.panicked = true;
            state.schedule.abort();
        }
        self.0.work.notify_all();
        self.0.news.notify_all();
    }
}
