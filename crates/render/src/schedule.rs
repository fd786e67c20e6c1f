//! Which piece of work comes next: the whole schedule as a state machine without threads or clocks.
//!
//! Passes go through four stages: *opened* (a buffer is emptied, and what the integrator prepares is built), *rendered* cell by
//! cell, *complete*, and *folded* into the film, block by block and in order. Several passes may be between the first and the
//! last stage (`window`), so that nobody waits at the end of a pass; integrators that prepare see one pass at a time. Passes
//! are counted here from zero; [`crate::stop::PassList`] knows their numbers.
//!
//! Whatever the order in which tasks end, the film gets the same sums: this file decides about time, never about bits.

use std::collections::VecDeque;
use std::ops::Range;

use integrators::Counters;

/// Blocks of the film that are folded in one go.
const FOLDED_AT_ONCE: usize = 8;

/// What a worker shall do.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Task {
    /// Make pass `0` ready.
    Open(u32),
    /// Render cell `.1` of pass `.0`.
    Cell(u32, usize),
    /// Fold these blocks of pass `.0` into the film; the first blocks begin the pass, the last ones end it.
    Fold(u32, Range<usize>),
    /// Nothing just now.
    Wait,
    /// Nothing ever again.
    Exit,
}

/// The sizes of things.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shape {
    /// Cells of a pass.
    pub(crate) n_cells: usize,
    /// Blocks of the film.
    pub(crate) n_blocks: usize,
    /// Passes that may be in the works at a time.
    pub(crate) window: u32,
    /// May a pass only open when all cells of those before are done, unless it is prepared already?
    pub(crate) sequential: bool,
}

/// How far everything is.
#[derive(Debug)]
pub(crate) struct Schedule {
    shape: Shape,
    /// Passes from here on are not wanted.
    end: u32,
    /// Passes below are in the film.
    folded: u32,
    /// Passes below are open.
    opened: u32,
    opening: bool,
    /// Passes below need no preparation any more.
    prepared: u32,
    /// The cell that is handed out next.
    next: (u32, usize),
    /// Of the open passes that are not in the film.
    works: VecDeque<Works>,
    fold: Option<Fold>,
    held: bool,
    counters: Counters,
}

/// An open pass.
#[derive(Clone, Copy, Debug, Default)]
struct Works {
    cells_done: usize,
    counters: Counters,
}

/// The pass that is being folded.
#[derive(Clone, Copy, Debug, Default)]
struct Fold {
    next: usize,
    done: usize,
}

impl Schedule {
    pub(crate) fn new(shape: Shape, n_passes: u32) -> Self {
        Self {
            shape,
            end: n_passes,
            folded: 0,
            opened: 0,
            opening: false,
            prepared: 0,
            next: (0, 0),
            works: VecDeque::with_capacity(shape.window as usize + 1),
            fold: None,
            held: false,
            counters: Counters::default(),
        }
    }

    /// What comes next. Every task but `Wait` and `Exit` must be given back to [`Schedule::finish`].
    pub(crate) fn next_task(&mut self) -> Task {
        if self.fold.is_none() && !self.held && self.folded < self.end && self.n_complete() > 0 {
            self.fold = Some(Fold::default());
        }
        if let Some(fold) = &mut self.fold
            && fold.next < self.shape.n_blocks
        {
            let start = fold.next;
            fold.next = (start + FOLDED_AT_ONCE).min(self.shape.n_blocks);
            return Task::Fold(self.folded, start..fold.next);
        }
        if self.folded == self.end {
            return Task::Exit;
        }
        if self.can_open() {
            self.opening = true;
            return Task::Open(self.opened);
        }
        let (pass, cell) = self.next;
        if pass < self.opened && pass < self.end {
            self.next = if cell + 1 < self.shape.n_cells { (pass, cell + 1) } else { (pass + 1, 0) };
            return Task::Cell(pass, cell);
        }
        Task::Wait
    }

    /// Does the pass that is being opened need a preparation?
    pub(crate) fn is_prepared(&self, pass: u32) -> bool {
        pass < self.prepared
    }

    /// What was prepared for the pass that is being opened holds for all below `end`.
    pub(crate) fn prepare_until(&mut self, end: u32) {
        self.prepared = end;
    }

    /// Takes a task back. True if others, who wait, may now find work.
    pub(crate) fn finish(&mut self, task: &Task, counters: &Counters) -> bool {
        match task {
            Task::Open(_) => {
                self.opened += 1;
                self.opening = false;
                self.works.push_back(Works { counters: *counters, ..Works::default() });
                true
            }
            Task::Cell(pass, _) => {
                let Some(works) = self.works.get_mut((pass - self.folded) as usize) else { return false };
                works.cells_done += 1;
                works.counters.add(counters);
                works.cells_done == self.shape.n_cells
            }
            Task::Fold(_, blocks) => self.finish_fold(blocks.len()),
            Task::Wait | Task::Exit => false,
        }
    }

    /// Is this task the last of its pass?
    pub(crate) fn is_last_fold(&self, blocks: usize) -> bool {
        self.fold.is_some_and(|f| f.done + blocks == self.shape.n_blocks)
    }

    /// No more than is complete everywhere. If `at_least` passes are not there yet, they will be done first.
    pub(crate) fn stop(&mut self, at_least: u32) {
        let complete = self.folded + u32::try_from(self.n_complete()).unwrap_or(u32::MAX);
        self.end = self.end.min(complete.max(at_least));
    }

    /// Nothing but to end what cannot be taken back.
    pub(crate) fn abort(&mut self) {
        self.end = self.folded + u32::from(self.fold.is_some());
    }

    /// Starts no fold until released; true when none is under way, so that the film holds whole passes and stays as it is.
    pub(crate) fn hold(&mut self) -> bool {
        self.held = true;
        self.fold.is_none()
    }

    /// Folds again.
    pub(crate) fn release(&mut self) {
        self.held = false;
    }

    /// Passes in the film.
    pub(crate) fn folded(&self) -> u32 {
        self.folded
    }

    /// Passes that are wanted.
    pub(crate) fn end(&self) -> u32 {
        self.end
    }

    /// What was done for the passes in the film.
    pub(crate) fn counters(&self) -> Counters {
        self.counters
    }

    /// What was done, for all passes.
    pub(crate) fn counters_so_far(&self) -> Counters {
        let mut sum = self.counters;
        self.works.iter().for_each(|w| sum.add(&w.counters));
        sum
    }

    /// Work done, in passes.
    pub(crate) fn passes_so_far(&self) -> f64 {
        let cells: usize = self.works.iter().map(|w| w.cells_done).sum();
        f64::from(self.folded) + cells as f64 / self.shape.n_cells as f64
    }

    fn n_complete(&self) -> usize {
        self.works.iter().take_while(|w| w.cells_done == self.shape.n_cells).count()
    }

    fn can_open(&self) -> bool {
        let free = self.opened < self.end && self.opened - self.folded < self.shape.window;
        let turn =
            !self.shape.sequential || self.is_prepared(self.opened) || self.works.len() == self.n_complete();
        free && turn && !self.opening
    }

    fn finish_fold(&mut self, n: usize) -> bool {
        let Some(fold) = &mut self.fold else { return false };
        fold.done += n;
        if fold.done < self.shape.n_blocks {
            return false;
        }
        self.fold = None;
        self.folded += 1;
        if let Some(works) = self.works.pop_front() {
            self.counters.add(&works.counters);
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SHAPE: Shape = Shape { n_cells: 3, n_blocks: 10, window: 2, sequential: false };
    const NONE: Counters = Counters { rays: 0, camera_paths: 0, light_paths: 0 };

    /// Runs with `n` imaginary workers who end their tasks in an odd order; what was done, in order.
    fn run(mut s: Schedule, n: usize, mut each: impl FnMut(&mut Schedule, usize)) -> Vec<Task> {
        let (mut busy, mut log): (Vec<Task>, Vec<Task>) = (Vec::new(), Vec::new());
        for step in 0..10_000 {
            while busy.len() < n {
                match s.next_task() {
                    Task::Wait | Task::Exit => break,
                    task @ (Task::Open(_) | Task::Cell(..) | Task::Fold(..)) => busy.push(task),
                }
            }
            if busy.is_empty() {
                assert_eq!(s.next_task(), Task::Exit, "stuck");
                return log;
            }
            let task = busy.swap_remove((step * 7) % busy.len());
            s.finish(&task, &Counters { rays: 1, ..NONE });
            log.push(task);
            each(&mut s, step);
        }
        panic!("does not end");
    }

    fn cells(log: &[Task], pass: u32) -> usize {
        log.iter().filter(|t| matches!(t, Task::Cell(p, _) if *p == pass)).count()
    }

    #[test]
    fn every_cell_and_every_block_once() {
        for (n, sequential) in [(1, false), (2, false), (5, false), (17, true), (2, true)] {
            let log = run(Schedule::new(Shape { sequential, ..SHAPE }, 6), n, |_, _| {});
            for pass in 0..6 {
                assert_eq!(cells(&log, pass), 3);
                let blocks: usize = log
                    .iter()
                    .map(|t| {
                        if let Task::Fold(p, b) = t
                            && *p == pass
                        {
                            b.len()
                        } else {
                            0
                        }
                    })
                    .sum();
                assert_eq!(blocks, 10);
            }
        }
    }

    #[test]
    fn nobody_waits_at_the_end_of_a_pass() {
        let mut s = Schedule::new(SHAPE, 4);
        assert_eq!(s.next_task(), Task::Open(0));
        assert_eq!(s.next_task(), Task::Wait);
        s.finish(&Task::Open(0), &NONE);
        assert_eq!(s.next_task(), Task::Open(1));
        s.finish(&Task::Open(1), &NONE);
        let handed: Vec<_> = (0..6).map(|_| s.next_task()).collect();
        assert_eq!(handed[2..4], [Task::Cell(0, 2), Task::Cell(1, 0)]);
        assert_eq!(s.next_task(), Task::Wait, "the window is full");
    }

    #[test]
    fn what_is_prepared_for_several_passes_opens_them_at_once() {
        let mut s = Schedule::new(Shape { sequential: true, window: 4, ..SHAPE }, 4);
        assert_eq!(s.next_task(), Task::Open(0));
        assert!(!s.is_prepared(0));
        s.prepare_until(2);
        s.finish(&Task::Open(0), &NONE);
        assert_eq!(s.next_task(), Task::Open(1));
        s.finish(&Task::Open(1), &NONE);
        let handed: Vec<_> = (0..6).map(|_| s.next_task()).collect();
        assert_eq!(handed[2..4], [Task::Cell(0, 2), Task::Cell(1, 0)]);
        assert_eq!(s.next_task(), Task::Wait, "the third pass needs another preparation");
    }

    #[test]
    fn what_prepares_sees_one_pass_at_a_time() {
        let mut s = Schedule::new(Shape { sequential: true, ..SHAPE }, 2);
        s.next_task();
        s.finish(&Task::Open(0), &NONE);
        let handed: Vec<_> = (0..3).map(|_| s.next_task()).collect();
        assert_eq!(s.next_task(), Task::Wait);
        handed.iter().for_each(|t| {
            s.finish(t, &NONE);
        });
        assert_eq!(s.next_task(), Task::Fold(0, 0..8));
        assert_eq!(s.next_task(), Task::Fold(0, 8..10));
        assert_eq!(s.next_task(), Task::Open(1), "the film is written while the next pass is prepared");
    }

    #[test]
    fn a_stop_keeps_complete_passes_and_drops_the_rest() {
        for at in 0..60 {
            let mut end = 0;
            let log = run(Schedule::new(SHAPE, 1000), 3, |s, step| {
                if step == at {
                    s.stop(1);
                    end = s.end();
                }
            });
            let folded = log.iter().filter(|t| matches!(t, Task::Fold(_, b) if b.end == 10)).count();
            assert_eq!(folded as u32, end);
            assert!(end >= 1);
            assert!((0..end).all(|p| cells(&log, p) == 3));
        }
    }

    #[test]
    fn an_abort_only_ends_the_fold_under_way() {
        let mut s = Schedule::new(SHAPE, 5);
        s.abort();
        assert_eq!(s.next_task(), Task::Exit);
    }

    #[test]
    fn a_held_film_is_not_touched() {
        let mut s = Schedule::new(Shape { n_cells: 1, n_blocks: 1, ..SHAPE }, 2);
        s.next_task();
        s.finish(&Task::Open(0), &NONE);
        s.next_task();
        s.finish(&Task::Open(1), &NONE);
        let cell = s.next_task();
        assert!(s.hold());
        s.finish(&cell, &NONE);
        assert_eq!(s.next_task(), Task::Cell(1, 0));
        assert_eq!(s.next_task(), Task::Wait);
        s.release();
        assert_eq!(s.next_task(), Task::Fold(0, 0..1));
        assert!(!s.hold(), "a fold is under way");
    }
}
