//! A binary tree over at most eight items: of all pairs the one with the smallest common box is joined, again and again.

use super::binary::{BinaryNode, Box4, Item};

/// More items than this are divided first.
pub(crate) const MOST: usize = 8;
/// Items and joined sets.
const SETS: usize = 2 * MOST - 1;

/// Reorders the items and writes the nodes in preorder. Nodes begin at `at` and items at `first` of the whole.
pub(crate) fn join(items: &mut [Item], nodes: &mut [BinaryNode], at: usize, first: usize) {
    if let [a, b] = items {
        nodes[0] = BinaryNode::in_preorder(&a.bounds().union(b.bounds()), at, first, [1, 1]);
        return;
    }
    let sets = Sets::new(items);
    let mut from = [items[0]; MOST];
    from[..items.len()].copy_from_slice(items);
    let mut writer =
        Writer { sets: &sets, from: &from[..items.len()], items, nodes, at, first, next: (0, 0) };
    writer.write(sets.root);
}

/// Items come first, then what was joined.
struct Sets {
    bounds: [Box4; SETS],
    children: [[u8; 2]; SETS],
    counts: [u8; SETS],
    root: usize,
}

impl Sets {
    fn new(items: &[Item]) -> Self {
        let n = items.len();
        let mut sets =
            Self { bounds: [Box4::EMPTY; SETS], children: [[0; 2]; SETS], counts: [1; SETS], root: 0 };
        let mut alive = [0_u8; MOST];
        let mut areas = [[f32::INFINITY; MOST]; MOST];
        for (i, item) in items.iter().enumerate() {
            (sets.bounds[i], alive[i]) = (item.bounds(), i as u8);
            for (area, other) in areas[i].iter_mut().zip(&sets.bounds[..i]) {
                *area = other.union(item.bounds()).half_area();
            }
        }
        for new in n..2 * n - 1 {
            let left = 2 * n - new;
            let (i, j) = least(&areas, left);
            let pair = [alive[j], alive[i]].map(usize::from);
            let bounds = sets.bounds[pair[0]].union(sets.bounds[pair[1]]);
            (sets.bounds[new], sets.children[new]) = (bounds, [alive[j], alive[i]]);
            sets.counts[new] = sets.counts[pair[0]] + sets.counts[pair[1]];
            // The last takes the place of one of the two, the new set that of the other; j < i.
            let last = left - 1;
            let row = areas[last];
            alive[i] = alive[last];
            for (k, &area) in row[..last].iter().enumerate() {
                put(&mut areas, i, k, area);
            }
            alive[j] = new as u8;
            for (k, &other) in alive[..last].iter().enumerate() {
                put(&mut areas, j, k, bounds.union(sets.bounds[usize::from(other)]).half_area());
            }
        }
        sets.root = 2 * n - 2;
        sets
    }
}

/// Sets the area for a pair; there is none of a set with itself.
#[inline]
fn put(areas: &mut [[f32; MOST]; MOST], i: usize, k: usize, area: f32) {
    if i != k {
        areas[i.max(k)][i.min(k)] = area;
    }
}

/// The pair `(i, j)`, `j < i < n`, of the least entry.
fn least(areas: &[[f32; MOST]; MOST], n: usize) -> (usize, usize) {
    let (mut best, mut pair) = (f32::INFINITY, (1, 0));
    for (i, row) in areas[..n].iter().enumerate() {
        for (j, &area) in row[..i].iter().enumerate() {
            if area < best {
                (best, pair) = (area, (i, j));
            }
        }
    }
    pair
}

struct Writer<'a> {
    sets: &'a Sets,
    from: &'a [Item],
    items: &'a mut [Item],
    nodes: &'a mut [BinaryNode],
    at: usize,
    first: usize,
    /// Nodes and items written.
    next: (usize, usize),
}

impl Writer<'_> {
    fn write(&mut self, set: usize) {
        let (node, item) = self.next;
        if let Some(&only) = self.from.get(set) {
            self.items[item] = only;
            self.next.1 += 1;
            return;
        }
        let [a, b] = self.sets.children[set].map(usize::from);
        let counts = [a, b].map(|s| usize::from(self.sets.counts[s]));
        self.nodes[node] =
            BinaryNode::in_preorder(&self.sets.bounds[set], self.at + node, self.first + item, counts);
        self.next.0 += 1;
        self.write(a);
        self.write(b);
    }
}
