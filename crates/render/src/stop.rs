//! When a render is done, and which passes that means.

use std::ops::Range;
use std::time::Duration;

use film::PassSet;

/// When a render is done.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Stop {
    /// When the film has these passes.
    Passes(Range<u32>),
    /// When this long was rendered, but not before the first pass is complete. A pass that is then not complete is dropped.
    Time(Duration),
}

/// Numbers of the passes that are still to be rendered, ascending.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct PassList(Vec<Range<u32>>);

impl PassList {
    /// What `stop` asks for and `present` does not have.
    pub(crate) fn new(stop: &Stop, present: &PassSet) -> Self {
        let wanted = match stop {
            Stop::Passes(range) => range.clone(),
            Stop::Time(_) => 0..u32::MAX,
        };
        let mut missing = Vec::new();
        let mut start = wanted.start;
        for range in present.ranges() {
            missing.push(start..range.start.min(wanted.end));
            start = start.max(range.end);
        }
        missing.push(start..wanted.end);
        missing.retain(|r| !r.is_empty());
        Self(missing)
    }

    /// How many.
    pub(crate) fn len(&self) -> u32 {
        self.0.iter().map(|r| r.end - r.start).sum()
    }

    /// How many come before pass `number`.
    pub(crate) fn before(&self, number: u32) -> u32 {
        self.0.iter().map(|r| r.end.min(number).saturating_sub(r.start)).sum()
    }

    /// The number of the `i`-th.
    pub(crate) fn number(&self, mut i: u32) -> u32 {
        for range in &self.0 {
            let n = range.end - range.start;
            if i < n {
                return range.start + i;
            }
            i -= n;
        }
        u32::MAX
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_is_missing_is_rendered() {
        let present: PassSet = "2..4,6..9".parse().unwrap();
        let list = PassList::new(&Stop::Passes(0..8), &present);
        let numbers: Vec<_> = (0..list.len()).map(|i| list.number(i)).collect();
        assert_eq!(numbers, [0, 1, 4, 5]);
        let before = [0, 1, 2, 4, 5, 6, 9, u32::MAX].map(|n| list.before(n));
        assert_eq!(before, [0, 1, 2, 2, 3, 4, 4, 4]);
        assert_eq!(PassList::new(&Stop::Passes(6..8), &present).len(), 0);
        assert_eq!(PassList::new(&Stop::Passes(3..12), &present).len(), 5);
    }

    #[test]
    fn a_time_has_no_last_pass() {
        let list = PassList::new(&Stop::Time(Duration::from_secs(1)), &PassSet::from_range(0..5));
        assert_eq!((list.number(0), list.number(7)), (5, 12));
    }
}
