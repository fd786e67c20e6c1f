//! Primary sample space [Kelemen2002]: the random numbers that make a path are a point, and a step of a chain is a move
//! of that point.
//!
//! A point is three streams of numbers, for the walk from the eye, for the walk from the light and for joining them,
//! and which path they make: how many scattering events, and how many of its vertices come from the light.
//!
//! Numbers that no state of a chain has read so far are drawn when they are, for both states of the step: see
//! [`remember`].

use math::trig;
use sampling::rng::Rng;
use scene::Scene;

use crate::bdpt::Weighting;

/// The three streams of numbers.
pub(super) const N_STREAMS: usize = 3;
pub(super) const EYE: usize = 0;
pub(super) const LIGHT: usize = 1;
pub(super) const JOINT: usize = 2;

/// Numbers as far as they were read.
pub(super) type Numbers = [Vec<f32>; N_STREAMS];

/// Which of the paths that a point can make.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Technique {
    /// Scattering events, at least one.
    pub(super) events: u32,
    /// Vertices from the light; events + 2 − s come from the eye.
    pub(super) s: u32,
    /// Deltas between the last vertex from the eye and the light, by manifold sampling; then no vertex comes from the light. Zero: all
    /// vertices come from one of the walks.
    pub(super) chain: u32,
}

impl Technique {
    pub(super) fn t(self) -> u32 {
        if self.chain == 0 { self.events + 2 - self.s } else { self.events + 1 - self.chain }
    }
}

/// Which techniques there are.
#[derive(Clone, Copy, Debug)]
pub(super) struct Kinds {
    /// Only a lens is found by walks from a light (t = 0).
    pub(super) has_lens: bool,
    /// Longest chain of manifold sampling.
    pub(super) chain: u32,
}

impl Kinds {
    pub(super) fn of(scene: &Scene, weighting: &Weighting) -> Self {
        Self { has_lens: scene.camera.has_lens(), chain: weighting.manifold as u32 }
    }

    /// How many make paths of so many events.
    pub(super) fn count(self, events: u32) -> u32 {
        self.of_walks(events) + self.of_chains(events)
    }

    /// One of them.
    pub(super) fn nth(self, events: u32, i: u32) -> Technique {
        match i.checked_sub(self.of_walks(events)) {
            None => Technique { events, s: i, chain: 0 },
            Some(chain) => Technique { events, s: 0, chain: chain + 1 },
        }
    }

    /// Is it one of them?
    pub(super) fn has(self, technique: Technique) -> bool {
        let Technique { events, s, chain } = technique;
        s < self.of_walks(events) && chain <= self.of_chains(events)
    }

    fn of_walks(self, events: u32) -> u32 {
        events + 2 + u32::from(self.has_lens)
    }

    /// The eye's walk has two events at least.
    fn of_chains(self, events: u32) -> u32 {
        self.chain.min(events.saturating_sub(2))
    }

    /// Place of a technique in a list of all: of 1 event those of walks and of chains, of 2 events, and so on.
    pub(super) fn index(self, t: Technique) -> usize {
        let before = self.index_of_events(t.events);
        before + if t.chain == 0 { t.s } else { t.events + 2 + t.chain } as usize
    }

    /// The technique at a place, though there may be none such.
    pub(super) fn at(self, index: usize) -> Technique {
        let mut events = 1;
        while self.index_of_events(events + 1) <= index {
            events += 1;
        }
        let i = (index - self.index_of_events(events)) as u32;
        match i.checked_sub(events + 3) {
            None => Technique { events, s: i, chain: 0 },
            Some(chain) => Technique { events, s: 0, chain: chain + 1 },
        }
    }

    fn index_of_events(self, events: u32) -> usize {
        let n = events as usize;
        (n - 1) * (n + 6) / 2 + (n - 1) * self.chain as usize
    }
}

/// What becomes of a stream's numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Change {
    /// So many stay what they are, the rest is drawn anew.
    Redrawn(usize),
    /// All take a small step.
    Nudged,
}

impl Change {
    pub(super) const ALL_NEW: Self = Self::Redrawn(0);
    pub(super) const NONE: Self = Self::Redrawn(usize::MAX);
}

/// Makes the proposal `to` from the state `from`.
pub(super) fn change(from: &Numbers, to: &mut Numbers, changes: [Change; N_STREAMS], rng: &mut Rng) {
    for ((from, to), change) in from.iter().zip(to).zip(changes) {
        to.clear();
        match change {
            Change::Redrawn(kept) => to.extend_from_slice(&from[..kept.min(from.len())]),
            Change::Nudged => to.extend(from.iter().map(|&x| nudged(x, rng.next_f32()))),
        }
    }
}

/// Gives a state its own values of numbers that only a step from it has read: what the proposal's would have come from.
/// Without them a rejected step would leave no trace, and the chain would not be reversible.
pub(super) fn remember(
    current: &mut Numbers,
    proposal: &Numbers,
    changes: [Change; N_STREAMS],
    rng: &mut Rng,
) {
    for ((own, proposed), change) in current.iter_mut().zip(proposal).zip(changes) {
        match change {
            Change::Redrawn(kept) => {
                let kept = kept.min(proposed.len());
                own.extend_from_slice(proposed.get(own.len()..kept).unwrap_or_default());
            }
            Change::Nudged => {
                for &x in proposed.iter().skip(own.len()) {
                    own.push(nudged(x, rng.next_f32()));
                }
            }
        }
    }
}

/// A small step, which wraps around: between 1/1024 and 1/64, even in its logarithm [Kelemen2002].
fn nudged(x: f32, u: f32) -> f32 {
    // One half of u is the sign, the rest the size 1/64 · 16^-v.
    const LN_RATIO: f32 = 2.772_588_7;
    let (sign, v) = if u < 0.5 { (1.0, 2.0 * u) } else { (-1.0, 2.0 * u - 1.0) };
    let y = x + sign * trig::exp(-LN_RATIO * v) / 64.0;
    let y = y - y.floor();
    if y < 1.0 { y } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn techniques_have_their_places_in_a_list() {
        for (has_lens, chain) in [(false, 0), (true, 0), (false, 2), (true, 8)] {
            let kinds = Kinds { has_lens, chain };
            let mut last = None;
            for events in 1..12 {
                for i in 0..kinds.count(events) {
                    let t = kinds.nth(events, i);
                    assert!(kinds.has(t) && kinds.at(kinds.index(t)) == t, "{t:?}");
                    assert!(last < Some(kinds.index(t)), "{t:?}");
                    last = Some(kinds.index(t));
                    assert!(t.t() + t.s + t.chain == events + 2 - u32::from(t.chain > 0), "{t:?}");
                }
                assert!(!kinds.has(Technique { events, s: events + 3, chain: 0 }));
            }
        }
    }

    #[test]
    fn a_state_keeps_numbers_that_a_step_read_first() {
        let start: Numbers = [vec![0.5], vec![], vec![0.1, 0.2]];
        let proposal: Numbers = [vec![0.51, 0.999, 0.25], vec![0.75], vec![0.1]];
        let mut rng = Rng::from_parts(&[1]);
        let mut current = start.clone();
        remember(&mut current, &proposal, [Change::Nudged; N_STREAMS], &mut rng);
        assert_eq!(current.each_ref().map(Vec::len), [3, 1, 2]);
        assert_eq!((current[0][0], &current[2]), (0.5, &vec![0.1, 0.2]), "what it had stays");
        for (own, proposed) in [(current[0][1], 0.999), (current[0][2], 0.25), (current[1][0], 0.75_f32)] {
            let d = (own - proposed).abs();
            let d = d.min(1.0 - d);
            assert!(d <= 1.0 / 64.0 + 1e-6 && d > 0.0, "{own} is one small step from {proposed}");
        }

        // What was kept is the same in both; what was drawn anew says nothing of the state.
        let mut current = start.clone();
        remember(&mut current, &proposal, [Change::Redrawn(2), Change::NONE, Change::ALL_NEW], &mut rng);
        assert_eq!(current, [vec![0.5, 0.999], vec![0.75], vec![0.1, 0.2]]);
    }

    #[test]
    fn a_step_changes_what_it_is_told() {
        let from: Numbers = [vec![0.1, 0.2, 0.3], vec![0.4], vec![0.5]];
        let mut to = Numbers::default();
        change(
            &from,
            &mut to,
            [Change::Redrawn(2), Change::NONE, Change::Nudged],
            &mut Rng::from_parts(&[2]),
        );
        assert_eq!((&to[0][..], &to[1][..]), (&[0.1, 0.2][..], &[0.4][..]));
        assert!(to[2].len() == 1 && to[2][0] != 0.5);
    }

    #[test]
    fn small_steps_are_small_symmetric_and_stay_in_the_unit_interval() {
        let n = 1000;
        let mut mean = 0.0;
        for i in 0..n {
            let d = nudged(0.5, (i as f32 + 0.5) / n as f32) - 0.5;
            assert!(d.abs() <= 1.0 / 64.0 + 1e-6 && d.abs() >= 1.0 / 1025.0);
            mean += d / n as f32;
            for x in [0.0, 1e-9, 0.999_999_9] {
                assert!((0.0..1.0).contains(&nudged(x, i as f32 / n as f32)));
            }
        }
        assert!(mean.abs() < 1e-6);
    }
}
