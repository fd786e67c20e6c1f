//! A density over directions: a quadtree over the equal-area square of the sphere, constant in every leaf
//! [Mueller2017, sec. 3].
//!
//! Departs from the paper: the square is folded to an octahedron, without the seams that cylindrical coordinates have at
//! the poles.

use math::Dir;
use sampling::{Pdf, SolidAngle, warp};
use serde::{Deserialize, Serialize};

/// Quadrants that hold more than this share of a tree are cut.
const CUT_ABOVE: f64 = 0.02;
/// Most cuts on the way from the square to a leaf.
const MAX_DEPTH: u32 = 16;
/// Most nodes of a tree.
pub(crate) const MAX_NODES: usize = 512;

/// A square cut into four. Quadrant `q` lies in the upper half of the first axis if its lowest bit is set, of the second
/// if the next one is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Node {
    /// Probabilities of the quadrants within the node; they sum to one.
    share: [f32; 4],
    /// Nodes of the quadrants; 0: a leaf. A child stands behind its parent.
    child: [u16; 4],
}

/// The density.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Quadtree {
    nodes: Vec<Node>,
}

/// What was found in the leaves of a tree: one number per quadrant of every node, zero where it is cut.
#[derive(Clone, Debug)]
pub(crate) struct Tally(Vec<[f64; 4]>);

impl Quadtree {
    /// All directions alike, cut as finely as the shares ask for.
    pub(crate) fn uniform() -> Self {
        Self::refined(&[Source { sum: [0.25; 4], child: [0; 4] }])
    }

    /// A direction of the density.
    pub(crate) fn sample(&self, mut u: [f32; 2]) -> Dir {
        let (mut corner, mut size, mut at) = ([0.0_f32; 2], 1.0_f32, 0_usize);
        loop {
            let node = &self.nodes[at];
            let s = node.share;
            let (x, ux) = choose([s[0] + s[2], s[1] + s[3]], u[0]);
            let (y, uy) = choose([s[x], s[x + 2]], u[1]);
            u = [ux, uy];
            size *= 0.5;
            corner = [corner[0] + size * x as f32, corner[1] + size * y as f32];
            let child = node.child[x + 2 * y];
            if child == 0 {
                return warp::equal_area_sphere([corner[0] + size * u[0], corner[1] + size * u[1]]);
            }
            at = usize::from(child);
        }
    }

    /// The density of [`Self::sample`].
    pub(crate) fn pdf(&self, w: Dir) -> Pdf<SolidAngle> {
        let (mut p, mut density, mut at) = (warp::equal_area_sphere_inverse(w), 1.0_f32, 0_usize);
        loop {
            let q = descend(&mut p);
            let node = &self.nodes[at];
            density *= 4.0 * node.share[q];
            if node.child[q] == 0 {
                return warp::equal_area_sphere_pdf() * density;
            }
            at = usize::from(node.child[q]);
        }
    }

    /// Nothing found yet.
    pub(crate) fn tally(&self) -> Tally {
        Tally(vec![[0.0; 4]; self.nodes.len()])
    }

    /// Spreads `value` over the leaves under a box about `w`, as large as the leaf that `w` falls into.
    pub(crate) fn splat(&self, tally: &mut Tally, w: Dir, value: f64) {
        let at = warp::equal_area_sphere_inverse(w);
        let side = self.leaf_side(at);
        let first = at.map(|x| (x - 0.5 * side).clamp(0.0, 1.0 - side));
        let the_box = Square { corner: first, side };
        let density = value / f64::from(side * side);
        self.spread(tally, 0, &Square { corner: [0.0; 2], side: 1.0 }, &the_box, density);
    }

    fn leaf_side(&self, mut p: [f32; 2]) -> f32 {
        let (mut side, mut at) = (1.0, 0_usize);
        loop {
            let q = descend(&mut p);
            side *= 0.5;
            match self.nodes[at].child[q] {
                0 => return side,
                child => at = usize::from(child),
            }
        }
    }

    fn spread(&self, tally: &mut Tally, at: usize, square: &Square, the_box: &Square, density: f64) {
        for q in 0..4 {
            let quadrant = square.quadrant(q);
            let common = quadrant.common_area(the_box);
            if common <= 0.0 {
                continue;
            }
            match self.nodes[at].child[q] {
                0 => tally.0[at][q] += density * f64::from(common),
                child => self.spread(tally, usize::from(child), &quadrant, the_box, density),
            }
        }
    }

    /// The tree that follows from what was found, and how much that is in all, if anything was. What was found before counts
    /// too: `earlier` in all, spread as the tree is.
    pub(crate) fn learned(&self, tally: &Tally, earlier: f64) -> Option<(Self, f64)> {
        let mut sources: Vec<Source> =
            self.nodes.iter().zip(&tally.0).map(|(n, &sum)| Source { sum, child: n.child }).collect();
        let mut before = vec![earlier; sources.len()];
        for (i, node) in self.nodes.iter().enumerate() {
            for q in 0..4 {
                let part = before[i] * f64::from(node.share[q]);
                match usize::from(node.child[q]) {
                    0 => sources[i].sum[q] += part,
                    child => before[child] = part,
                }
            }
        }
        // Children stand behind their parents.
        for i in (0..sources.len()).rev() {
            for q in 0..4 {
                let child = usize::from(sources[i].child[q]);
                if child != 0 {
                    sources[i].sum[q] = sources[child].total();
                }
            }
        }
        let total = sources[0].total();
        (total > 0.0 && total.is_finite()).then(|| (Self::refined(&sources), total))
    }

    /// Cuts what holds much and joins what holds little, breadth first.
    fn refined(sources: &[Source]) -> Self {
        let total = sources[0].total();
        let mut open = std::collections::VecDeque::from([(0_usize, sources[0], 1_u32)]);
        let mut nodes = vec![sources[0].node()];
        while let Some((at, source, depth)) = open.pop_front() {
            for q in 0..4 {
                if source.sum[q] <= CUT_ABOVE * total || depth >= MAX_DEPTH || nodes.len() >= MAX_NODES {
                    continue;
                }
                let inner = match source.child[q] {
                    0 => Source { sum: [0.25 * source.sum[q]; 4], child: [0; 4] },
                    child => sources[usize::from(child)],
                };
                nodes[at].child[q] = nodes.len() as u16;
                open.push_back((nodes.len(), inner, depth + 1));
                nodes.push(inner.node());
            }
        }
        Self { nodes }
    }

    /// Bytes of a tree and its tally at their largest.
    pub(crate) const fn most_bytes() -> usize {
        MAX_NODES * (size_of::<Node>() + size_of::<[f64; 4]>())
    }
}

/// A node while a tree is made.
#[derive(Clone, Copy)]
struct Source {
    sum: [f64; 4],
    child: [u16; 4],
}

impl Source {
    fn total(&self) -> f64 {
        self.sum.iter().sum()
    }

    fn node(&self) -> Node {
        let total = self.total();
        let share = |x: f64| if total > 0.0 { (x / total) as f32 } else { 0.25 };
        Node { share: self.sum.map(share), child: [0; 4] }
    }
}

/// A part of the unit square.
struct Square {
    corner: [f32; 2],
    side: f32,
}

impl Square {
    fn quadrant(&self, q: usize) -> Self {
        let side = 0.5 * self.side;
        let along = |axis: usize| self.corner[axis] + side * ((q >> axis) & 1) as f32;
        Self { corner: [along(0), along(1)], side }
    }

    fn common_area(&self, other: &Self) -> f32 {
        let along = |axis: usize| {
            let end = (self.corner[axis] + self.side).min(other.corner[axis] + other.side);
            (end - self.corner[axis].max(other.corner[axis])).max(0.0)
        };
        along(0) * along(1)
    }
}

/// One of two halves in proportion to their shares, and `u` used again within it.
fn choose(shares: [f32; 2], u: f32) -> (usize, f32) {
    let at = u * (shares[0] + shares[1]);
    if at < shares[0] || shares[1] <= 0.0 {
        (0, (at / shares[0]).min(1.0_f32.next_down()))
    } else {
        (1, ((at - shares[0]) / shares[1]).min(1.0_f32.next_down()))
    }
}

/// The quadrant of a point, which becomes its place within it.
fn descend(p: &mut [f32; 2]) -> usize {
    let mut q = 0;
    for (axis, x) in p.iter_mut().enumerate() {
        *x *= 2.0;
        if *x >= 1.0 {
            *x -= 1.0;
            q |= 1 << axis;
        }
    }
    q
}

#[cfg(test)]
mod tests {
    use sampling::rng::Rng;
    use testkit::chi2::{Chi2Settings, chi2_rectangle};

    use super::*;

    /// Two lamps and a glow, of which the tree was told by noisy records.
    fn trained(seed: u64) -> Quadtree {
        let mut tree = Quadtree::uniform();
        let mut rng = Rng::from_parts(&[seed]);
        for _ in 0..3 {
            let mut tally = tree.tally();
            for _ in 0..20_000 {
                let w = warp::equal_area_sphere([rng.next_f32(), rng.next_f32()]);
                let lamp = |c: f32| if c > 0.98 { 50.0 } else { 0.0 };
                let value = 0.1 + lamp(w.0.x) + lamp(-w.0.z) * w.0.y.abs();
                tree.splat(&mut tally, w, f64::from(value));
            }
            tree = tree.learned(&tally, 0.0).unwrap().0;
        }
        tree
    }

    #[test]
    fn directions_follow_the_density() {
        for tree in [Quadtree::uniform(), trained(1)] {
            // Over the square, where the edges of cells are edges of leaves.
            let settings = Chi2Settings { cells: [32, 32], samples: 400_000, ..Chi2Settings::default() };
            let found = chi2_rectangle(
                [[0.0, 1.0]; 2],
                &settings,
                |u| Some(warp::equal_area_sphere_inverse(tree.sample(u)).map(f64::from)),
                |x, y| {
                    let w = warp::equal_area_sphere([x as f32, y as f32]);
                    f64::from(tree.pdf(w).value()) * 2.0 * std::f64::consts::TAU
                },
            );
            assert!(found.is_ok(), "{found:?}");
        }
    }

    #[test]
    fn what_is_splat_is_all_there_whatever_the_box() {
        let tree = trained(2);
        let (mut tally, mut rng, mut sum) = (tree.tally(), Rng::from_parts(&[3]), 0.0);
        for i in 0..1000 {
            let w = warp::equal_area_sphere([rng.next_f32(), rng.next_f32()]);
            tree.splat(&mut tally, w, f64::from(i));
            sum += f64::from(i);
        }
        let found: f64 = tally.0.iter().flatten().sum();
        assert!((found / sum - 1.0).abs() < 1e-4, "{found} {sum}");
    }

    #[test]
    fn what_was_found_before_counts_by_its_mass() {
        let tree = trained(6);
        let mut tally = tree.tally();
        let w = Dir(math::Vec3::Z);
        tree.splat(&mut tally, w, 30.0);
        let (learned, mass) = tree.learned(&tally, 10.0).unwrap();
        assert!((mass - 40.0).abs() < 1e-4, "{mass}");
        // Far from the new, a quarter of the old density is left, also where cells were joined.
        let lamp = |t: &Quadtree| {
            let mut rng = Rng::from_parts(&[7]);
            let towards = (0..20_000).map(|_| t.sample([rng.next_f32(), rng.next_f32()]));
            towards.filter(|w| w.0.x > 0.9).count() as f32 / 20_000.0
        };
        let (before, after) = (lamp(&tree), lamp(&learned));
        // Five standard deviations of the two counts.
        let bound = 5.0 * ((before / 16.0 + after) / 20_000.0).sqrt();
        assert!((after - 0.25 * before).abs() < bound, "{before} {after} ± {bound}");
    }

    #[test]
    fn a_tree_is_cut_where_much_is_and_never_beyond_its_budget() {
        let tree = trained(4);
        assert!(tree.nodes.len() > 50 && tree.nodes.len() <= MAX_NODES, "{}", tree.nodes.len());
        let mut spike = Quadtree::uniform();
        for _ in 0..10 {
            let mut tally = spike.tally();
            for i in 0..200 {
                let w = warp::equal_area_sphere([0.3 + 1e-6 * i as f32, 0.7]);
                spike.splat(&mut tally, w, 1.0);
            }
            spike = spike.learned(&tally, 0.0).unwrap().0;
        }
        assert!(spike.nodes.len() <= MAX_NODES);
        let towards = warp::equal_area_sphere([0.3001, 0.7]);
        assert!(spike.pdf(towards).value() > 1e4, "{:?}", spike.pdf(towards));
        assert!(spike.learned(&spike.tally(), 0.0).is_none(), "nothing found, nothing learned");
    }
}
