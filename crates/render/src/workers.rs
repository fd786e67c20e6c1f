//! Threads: the only place that starts any.

use std::num::NonZero;
use std::thread;

use crate::Error;

/// Integrators may recurse once for every bounce.
const STACK_BYTES: usize = 16 << 20;

/// A number of threads: for reading and building scenes a pool, for cells as many workers.
pub struct Workers {
    pool: rayon::ThreadPool,
    n: usize,
}

impl Workers {
    /// `n` threads; `None`: as many as the machine has for us.
    ///
    /// # Errors
    /// The system gives no threads.
    pub fn new(n: Option<NonZero<usize>>) -> Result<Self, Error> {
        let n = n.or_else(|| thread::available_parallelism().ok()).map_or(1, NonZero::get);
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(n)
            .stack_size(STACK_BYTES)
            .thread_name(|i| format!("steradian-{i}"))
            .build()
            .map_err(|e| Error::Threads { n, message: e.to_string() })?;
        Ok(Self { pool, n })
    }

    /// How many.
    #[must_use]
    pub fn len(&self) -> usize {
        self.n
    }

    /// Never: there is at least one.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.n == 0
    }

    /// Runs `f` so that its parallel loops use these threads and no others.
    pub fn install<R: Send>(&self, f: impl FnOnce() -> R + Send) -> R {
        self.pool.install(f)
    }

    /// Runs `work` on every thread, and `watch` on this one meanwhile. A panic of a worker goes on here, when all have ended.
    pub(crate) fn run<R>(&self, work: impl Fn() + Sync, watch: impl FnOnce() -> R) -> Result<R, Error> {
        let work = &work;
        thread::scope(|scope| {
            for i in 0..self.n {
                let worker = thread::Builder::new().name(format!("cell-{i}")).stack_size(STACK_BYTES);
                let started = worker.spawn_scoped(scope, work);
                // With one worker there is no reason to give up.
                if let (Err(e), 0) = (started, i) {
                    return Err(Error::Threads { n: self.n, message: e.to_string() });
                }
            }
            Ok(watch())
        })
    }
}
