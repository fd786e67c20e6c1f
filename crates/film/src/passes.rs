//! Which passes a film holds: a set of half-open ranges.

use std::fmt;
use std::ops::Range;
use std::str::FromStr;

/// Disjoint ranges in ascending order, never adjacent, never empty: equal sets have equal representations.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash)]
pub struct PassSet(Vec<Range<u32>>);

impl PassSet {
    /// The passes of one range.
    #[must_use]
    pub fn from_range(range: Range<u32>) -> Self {
        Self(if range.is_empty() { Vec::new() } else { vec![range] })
    }

    /// How many passes.
    #[must_use]
    pub fn len(&self) -> u64 {
        self.0.iter().map(|r| u64::from(r.end - r.start)).sum()
    }

    /// None at all?
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The ranges, ascending.
    #[must_use]
    pub fn ranges(&self) -> &[Range<u32>] {
        &self.0
    }

    /// Is the pass in the set?
    #[must_use]
    pub fn contains(&self, pass: u32) -> bool {
        let i = self.0.partition_point(|r| r.end <= pass);
        self.0.get(i).is_some_and(|r| r.contains(&pass))
    }

    /// The first pass that is not in the set.
    #[must_use]
    pub fn first_missing(&self) -> u32 {
        self.0.first().map_or(0, |r| if r.start == 0 { r.end } else { 0 })
    }

    /// What both have.
    #[must_use]
    pub fn intersection(&self, other: &Self) -> Self {
        let (mut i, mut j, mut out) = (0, 0, Vec::new());
        while let (Some(a), Some(b)) = (self.0.get(i), other.0.get(j)) {
            let both = a.start.max(b.start)..a.end.min(b.end);
            if !both.is_empty() {
                out.push(both);
            }
            if a.end < b.end { i += 1 } else { j += 1 }
        }
        Self(out)
    }

    /// What either has.
    #[must_use]
    pub fn union(&self, other: &Self) -> Self {
        let mut all: Vec<_> = self.0.iter().chain(&other.0).cloned().collect();
        all.sort_by_key(|r| r.start);
        let mut out: Vec<Range<u32>> = Vec::with_capacity(all.len());
        for r in all {
            match out.last_mut() {
                Some(last) if r.start <= last.end => last.end = last.end.max(r.end),
                Some(_) | None => out.push(r),
            }
        }
        Self(out)
    }

    /// Adds one pass.
    pub fn insert(&mut self, pass: u32) {
        // The usual case first: passes come in order.
        match self.0.last_mut() {
            Some(last) if last.end == pass => last.end += 1,
            Some(_) | None => *self = self.union(&Self::from_range(pass..pass + 1)),
        }
    }
}

impl fmt::Display for PassSet {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, r) in self.0.iter().enumerate() {
            write!(f, "{}{}..{}", if i == 0 { "" } else { "," }, r.start, r.end)?;
        }
        if self.0.is_empty() { f.write_str("none") } else { Ok(()) }
    }
}

impl FromStr for PassSet {
    type Err = String;

    /// Reads what [`fmt::Display`] writes: ascending, disjoint, not adjacent.
    fn from_str(s: &str) -> Result<Self, String> {
        if s == "none" {
            return Ok(Self::default());
        }
        let mut out: Vec<Range<u32>> = Vec::new();
        for part in s.split(',') {
            let range = part
                .split_once("..")
                .and_then(|(a, b)| Some(a.parse().ok()?..b.parse().ok()?))
                .filter(|r: &Range<u32>| !r.is_empty() && out.last().is_none_or(|l| l.end < r.start))
                .ok_or_else(|| format!("`{part}` is not the next range of passes A..B"))?;
            out.push(range);
        }
        Ok(Self(out))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::BTreeSet;

    fn set(passes: &BTreeSet<u32>) -> PassSet {
        let mut s = PassSet::default();
        passes.iter().rev().for_each(|&p| s.insert(p));
        s
    }

    proptest! {
        #[test]
        fn it_is_a_set(a in prop::collection::btree_set(0_u32..40, 0..30),
                       b in prop::collection::btree_set(0_u32..40, 0..30)) {
            let (x, y) = (set(&a), set(&b));
            prop_assert_eq!(x.len(), a.len() as u64);
            prop_assert!((0..41).all(|p| x.contains(p) == a.contains(&p)));
            prop_assert_eq!(x.union(&y), set(&a.union(&b).copied().collect()));
            prop_assert_eq!(x.intersection(&y), set(&a.intersection(&b).copied().collect()));
            prop_assert_eq!(x.to_string().parse::<PassSet>().unwrap(), x.clone());
            prop_assert_eq!(x.first_missing(), (0..).find(|p| !a.contains(p)).unwrap());
        }
    }

    #[test]
    fn nonsense_is_refused() {
        for s in ["", "3", "5..5", "5..3", "0..4,2..6", "0..4,4..6", "a..b", "0..99999999999"] {
            assert!(s.parse::<PassSet>().is_err(), "{s}");
        }
    }
}
