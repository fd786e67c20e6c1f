//! Neighbours: which points of a set lie near a place, by radius or the k nearest.
//!
//! A balanced kd-tree [Bentley1975] without pointers: points in the order of the leaves, all leaves full but the last;
//! inner nodes in pre-order, so that a node's number and its count of leaves say where its children are.
//!
//! The tree is a function of the points and their order alone (ties on a coordinate go by index, leaves are in order of
//! index), whatever the number of threads that build it; so is the order in which a query tells what it finds.

use std::collections::BinaryHeap;

use math::{Bounds, Point};

/// Points of a leaf.
const LEAF: usize = 8;

/// Below so many points a subtree is built by one thread.
const PARALLEL: usize = 1 << 14;

/// More than any tree of 2³² points is deep, in either order of visit.
const STACK: usize = 64;

/// A set of points that can be asked for neighbours. 16 bytes a point, and 8 for every eight.
#[derive(Debug, Default)]
pub(crate) struct Neighbours {
    /// In the order of the leaves, with their index.
    points: Vec<(Point, u32)>,
    inner: Vec<Inner>,
    /// The farthest reach in each inner node, and in each leaf; see [`Neighbours::with_reach`].
    reach: [Vec<f32>; 2],
}

/// A plane between two halves: `coordinate ≤ at` on the left, `≥ at` on the right.
#[derive(Clone, Copy, Debug, Default)]
struct Inner {
    at: f32,
    axis: u32,
}

/// A neighbour.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Near {
    /// Square of its distance.
    pub(crate) distance_squared: f32,
    /// Its index.
    pub(crate) index: u32,
}

impl Eq for Near {}

impl Ord for Near {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.distance_squared.total_cmp(&other.distance_squared).then(self.index.cmp(&other.index))
    }
}

impl PartialOrd for Near {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

/// A node on the way: its number, its first leaf and how many it has.
#[derive(Clone, Copy, Default)]
struct Node {
    number: usize,
    leaf: usize,
    n_leaves: usize,
}

impl Node {
    fn children(self) -> [Self; 2] {
        let left = self.n_leaves.div_ceil(2);
        [
            Self { number: self.number + 1, leaf: self.leaf, n_leaves: left },
            Self { number: self.number + left, leaf: self.leaf + left, n_leaves: self.n_leaves - left },
        ]
    }
}

impl Neighbours {
    /// The tree of points, each with an index of its own by which it is told; those that are not finite are found by
    /// nobody. Uses the threads of the current pool.
    pub(crate) fn build(points: impl Iterator<Item = (Point, u32)>) -> Self {
        let mut points: Vec<(Point, u32)> = points.filter(|(p, _)| p.0.is_finite()).collect();
        let mut inner = vec![Inner::default(); points.len().div_ceil(LEAF).saturating_sub(1)];
        split(&mut points, &mut inner);
        Self { points, inner, reach: Default::default() }
    }

    #[cfg(test)]
    /// How many points there are.
    pub(crate) fn len(&self) -> usize {
        self.points.len()
    }

    /// Calls `visit` for every point no farther than `radius`, always in the same order.
    pub(crate) fn within(&self, center: Point, radius: f32, mut visit: impl FnMut(Near)) {
        let radius_squared = radius * radius;
        let mut stack = [Node::default(); STACK];
        let mut n = self.push_root(&mut stack);
        while n > 0 {
            n -= 1;
            let node = stack[n];
            if node.n_leaves == 1 {
                self.leaf(node.leaf, center)
                    .filter(|f| f.distance_squared <= radius_squared)
                    .for_each(&mut visit);
                continue;
            }
            let plane = self.inner[node.number];
            let beyond = center.0[plane.axis as usize] - plane.at;
            let [left, right] = node.children();
            if beyond >= -radius {
                stack[n] = right;
                n += 1;
            }
            if beyond <= radius {
                stack[n] = left;
                n += 1;
            }
        }
    }

    /// Gives every point, by its index, a reach of its own, for [`Neighbours::reaching`].
    pub(crate) fn with_reach(mut self, reach_of: impl Fn(u32) -> f32) -> Self {
        let farthest = |points: &[(Point, u32)]| points.iter().map(|p| reach_of(p.1)).fold(0.0, f32::max);
        let leaves: Vec<f32> = self.points.chunks(LEAF).map(farthest).collect();
        let mut inner = vec![0.0; self.inner.len()];
        let mut roots = [Node::default(); STACK];
        if self.push_root(&mut roots) > 0 {
            reach_below(roots[0], &mut inner, &leaves);
        }
        self.reach = [inner, leaves];
        self
    }

    /// Calls `visit` for every point that reaches `place`, and for some others near it, always in the same order.
    pub(crate) fn reaching(&self, place: Point, mut visit: impl FnMut(Near)) {
        let [inner_reach, leaf_reach] = &self.reach;
        let mut stack = [(Node::default(), 0.0); STACK];
        let mut roots = [Node::default(); STACK];
        let mut n = self.push_root(&mut roots);
        stack[0].0 = roots[0];
        while n > 0 {
            n -= 1;
            let (node, at_least) = stack[n];
            if node.n_leaves == 1 {
                if at_least <= leaf_reach[node.leaf] {
                    self.leaf(node.leaf, place).for_each(&mut visit);
                }
                continue;
            }
            let reach = inner_reach[node.number];
            if at_least > reach {
                continue;
            }
            let plane = self.inner[node.number];
            let beyond = place.0[plane.axis as usize] - plane.at;
            let [left, right] = node.children();
            if beyond >= -reach {
                stack[n] = (right, (-beyond).max(at_least));
                n += 1;
            }
            if beyond <= reach {
                stack[n] = (left, beyond.max(at_least));
                n += 1;
            }
        }
    }

    /// The `k` nearest points that are no farther than `radius`, into `found`, which is emptied first. Of points
    /// equally far, the first by index are taken.
    pub(crate) fn nearest(&self, center: Point, k: usize, radius: f32, found: &mut BinaryHeap<Near>) {
        found.clear();
        if k == 0 {
            return;
        }
        let mut limit = radius * radius;
        let mut stack = [(Node::default(), 0.0); STACK];
        let mut roots = [Node::default(); STACK];
        let mut n = self.push_root(&mut roots);
        stack[0].0 = roots[0];
        while n > 0 {
            n -= 1;
            let (node, at_least) = stack[n];
            if at_least > limit {
                continue;
            }
            if node.n_leaves == 1 {
                for near in self.leaf(node.leaf, center).filter(|f| f.distance_squared <= limit) {
                    if found.len() < k {
                        found.push(near);
                    } else if found.peek().is_some_and(|worst| near < *worst) {
                        found.pop();
                        found.push(near);
                    }
                }
                if let Some(worst) = found.peek().filter(|_| found.len() == k) {
                    limit = worst.distance_squared;
                }
                continue;
            }
            let plane = self.inner[node.number];
            let beyond = center.0[plane.axis as usize] - plane.at;
            let [mut near, mut far] = node.children();
            if beyond > 0.0 {
                std::mem::swap(&mut near, &mut far);
            }
            stack[n] = (far, beyond * beyond);
            stack[n + 1] = (near, at_least);
            n += 2;
        }
    }

    fn push_root(&self, stack: &mut [Node; STACK]) -> usize {
        stack[0] = Node { number: 0, leaf: 0, n_leaves: self.points.len().div_ceil(LEAF) };
        usize::from(!self.points.is_empty())
    }

    fn leaf(&self, leaf: usize, center: Point) -> impl Iterator<Item = Near> + '_ {
        let points = &self.points[leaf * LEAF..((leaf + 1) * LEAF).min(self.points.len())];
        points.iter().map(move |&(p, index)| Near { distance_squared: (p - center).length_squared(), index })
    }
}

/// Sets the reach of a node and of all below it.
fn reach_below(node: Node, inner: &mut [f32], leaves: &[f32]) -> f32 {
    if node.n_leaves == 1 {
        return leaves[node.leaf];
    }
    let reach = node.children().map(|child| reach_below(child, inner, leaves));
    inner[node.number] = reach[0].max(reach[1]);
    inner[node.number]
}

/// Orders the points of a subtree and sets its inner nodes.
fn split(points: &mut [(Point, u32)], inner: &mut [Inner]) {
    let Some((own, rest)) = inner.split_first_mut() else {
        points.sort_unstable_by_key(|p| p.1);
        return;
    };
    // Across the widest side, between two leaves.
    let bounds = points.iter().fold(Bounds::EMPTY, |b, p| b.grow(p.0.0));
    let size = bounds.size();
    let axis = if size.x >= size.y && size.x >= size.z { 0 } else { 1 + usize::from(size.z > size.y) };
    let left_leaves = points.len().div_ceil(LEAF).div_ceil(2);
    let (left, first, _) = points.select_nth_unstable_by(left_leaves * LEAF, |a, b| {
        a.0.0[axis].total_cmp(&b.0.0[axis]).then(a.1.cmp(&b.1))
    });
    *own = Inner { at: first.0.0[axis], axis: axis as u32 };

    let n_left = left.len();
    let (left, right) = points.split_at_mut(n_left);
    let (left_inner, right_inner) = rest.split_at_mut(left_leaves - 1);
    if left.len() + right.len() < PARALLEL {
        split(left, left_inner);
        split(right, right_inner);
    } else {
        rayon::join(|| split(left, left_inner), || split(right, right_inner));
    }
}

#[cfg(test)]
mod tests {
    use math::Vec3;
    use sampling::rng::Rng;

    use super::*;

    /// Clustered in places, with many equal points and coordinates.
    fn points(n: usize, key: u64) -> Vec<Point> {
        let mut rng = Rng::new(key);
        (0..n)
            .map(|i| {
                let mut c = || rng.next_f32();
                match i % 4 {
                    0 => Point::new(c(), c(), 0.5),
                    1 => Point::new((c() * 8.0).floor() / 8.0, (c() * 8.0).floor() / 8.0, 0.0),
                    2 => Point(Vec3::splat(0.25) + Vec3::new(c(), c(), c()) * 1e-3),
                    _ => Point::new(c(), c(), c()),
                }
            })
            .collect()
    }

    fn brute(points: &[Point], center: Point, radius: f32) -> Vec<Near> {
        let all = points
            .iter()
            .zip(0..)
            .map(|(&p, index)| Near { distance_squared: (p - center).length_squared(), index });
        let mut found: Vec<_> = all.filter(|n| n.distance_squared <= radius * radius).collect();
        found.sort_unstable();
        found
    }

    #[test]
    fn radius_and_nearest_find_what_a_search_of_all_finds() {
        for n in [0, 1, 2, 7, 8, 9, 16, 17, 63, 500, 3000] {
            let points = points(n, 3 + n as u64);
            let tree = Neighbours::build(points.iter().copied().zip(0..));
            assert_eq!(tree.len(), n);
            let mut rng = Rng::new(9);
            let mut heap = BinaryHeap::new();
            for i in 0..200 {
                let center = match points.get(i) {
                    Some(p) if i % 2 == 0 => *p,
                    _ => Point::new(rng.next_f32(), rng.next_f32(), rng.next_f32()),
                };
                let radius = [0.0, 1e-3, 0.125, 0.3, 2.0][i % 5];
                let truth = brute(&points, center, radius);
                let mut found = Vec::new();
                tree.within(center, radius, |n| found.push(n));
                found.sort_unstable();
                assert_eq!(found, truth, "{n} points, radius {radius}");
                for k in [1, 5, 40] {
                    tree.nearest(center, k, radius, &mut heap);
                    let found = heap.clone().into_sorted_vec();
                    assert_eq!(found, truth[..k.min(truth.len())], "{n} points, {k} within {radius}");
                }
            }
        }
    }

    #[test]
    fn every_point_that_reaches_a_place_is_visited() {
        for n in [0, 1, 8, 9, 300, 3000] {
            let points = points(n, 7 + n as u64);
            let reach_of = |i: u32| [0.0, 0.01, 0.05, 0.4][i as usize % 4] * (1.0 + (i % 7) as f32);
            let tree = Neighbours::build(points.iter().copied().zip(0..)).with_reach(reach_of);
            let mut rng = Rng::new(4);
            for _ in 0..200 {
                let place = Point::new(rng.next_f32(), rng.next_f32(), rng.next_f32());
                let mut found = Vec::new();
                tree.reaching(place, |near| {
                    if near.distance_squared <= reach_of(near.index).powi(2) {
                        found.push(near);
                    }
                });
                found.sort_unstable();
                let all = brute(&points, place, 9.0);
                let truth: Vec<Near> =
                    all.into_iter().filter(|a| a.distance_squared <= reach_of(a.index).powi(2)).collect();
                assert_eq!(found, truth, "{n} points");
            }
        }
    }

    /// More than one thread's share, so that the pool is used.
    #[test]
    fn the_order_of_a_query_does_not_depend_on_threads() {
        let points = points(3 * PARALLEL, 5);
        let order = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let tree = pool.install(|| Neighbours::build(points.iter().copied().zip(0..)));
            let mut found = Vec::new();
            tree.within(Point::new(0.3, 0.3, 0.3), 0.2, |n| found.push(n.index));
            (tree.points, found)
        };
        let (tree, found) = order(1);
        assert!(found.len() > 1000);
        for threads in [2, 3, 8] {
            let (t, f) = order(threads);
            assert!(t == tree && f == found, "{threads} threads");
        }
    }

    #[test]
    fn points_that_are_nowhere_are_left_out() {
        let far =
            [Point::new(f32::NAN, 0.0, 0.0), Point::new(0.0, f32::INFINITY, 0.0), Point::new(1.0, 0.0, 0.0)];
        let tree = Neighbours::build(far.into_iter().zip(0..));
        let mut found = Vec::new();
        tree.within(Point::default(), f32::INFINITY, |n| found.push(n.index));
        assert_eq!(found, [2]);
    }
}
