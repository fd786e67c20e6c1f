//! The whole scene as rays see it: static geometry, and instances of objects.

use math::{Bounds, Ray};

use crate::blas::Blas;
use crate::build::{self, BuildOptions, Item, LeafCost};
use crate::error::BuildError;
use crate::hit::{Best, Hit, NO_INSTANCE};
use crate::instance::{Instance, Placed};
use crate::isa::Isa;
use crate::kernels;
use crate::layout::{ChildRef, Node, WideTree};
use crate::ray_space;

/// Entering an object costs many node visits, so each instance has a box of its own.
const INSTANCE_COST: LeafCost = LeafCost { max_items: 1, fixed: 8.0 };

/// Static geometry in world space, objects, and instances of them.
#[derive(Clone, Debug)]
pub struct Accel {
    pub(crate) world: Blas,
    pub(crate) objects: Vec<Blas>,
    pub(crate) placed: Vec<Placed>,
    pub(crate) top: WideTree,
    /// Around everything.
    pub(crate) bounds: Bounds,
    /// See [`ray_space::reach`].
    pub(crate) reach: f32,
    isa: Isa,
}

/// What an [`Accel`] consists of.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AccelStats {
    /// Triangles at rest that are stored (not counting instances).
    pub triangles: usize,
    /// Other primitives that are stored.
    pub others: usize,
    /// Primitives left out.
    pub skipped: usize,
    /// Objects.
    pub objects: usize,
    /// Instances.
    pub instances: usize,
    /// Inner nodes of all trees.
    pub nodes: usize,
    /// Size in memory.
    pub bytes: usize,
}

impl Accel {
    /// `world` is seen as it is, each of `objects` where instances place it.
    pub fn new(world: Blas, objects: Vec<Blas>, instances: &[Instance]) -> Result<Self, BuildError> {
        for (i, instance) in instances.iter().enumerate() {
            if instance.object as usize >= objects.len() {
                let (object, len) = (instance.object, objects.len());
                return Err(BuildError::NoSuchObject { instance: i, object, len });
            }
        }
        let placed: Vec<Placed> =
            instances.iter().map(|i| Placed::new(i, &objects[i.object as usize].bounds())).collect();
        let mut items: Vec<Item> = Vec::with_capacity(placed.len());
        let finite = |b: &Bounds| !b.is_empty() && b.min.is_finite() && b.max.is_finite();
        for (p, i) in placed.iter().zip(0..).filter(|(p, _)| finite(&p.bounds)) {
            items.push(Item::new(&p.bounds, i, 0));
        }
        let bounds = items.iter().fold(world.bounds(), |b, i| b.union(i.bounds().to_bounds()));
        let (mut top, leaves) = build::build(&mut items, &BuildOptions::default(), &INSTANCE_COST);
        top.refer(|leaf| ChildRef::mixed(leaves[leaf].of(&items)[0].id() as usize));
        Ok(Self { world, objects, placed, top, bounds, reach: ray_space::reach(&bounds), isa: Isa::detect() })
    }

    /// Without instances.
    #[must_use]
    pub fn from_static(world: Blas) -> Self {
        let top = WideTree::default();
        let (objects, placed, bounds) = (Vec::new(), Vec::new(), world.bounds());
        Self { world, objects, placed, top, bounds, reach: ray_space::reach(&bounds), isa: Isa::detect() }
    }

    /// Uses the kernel for `isa` if this processor runs it, else leaves everything as it is.
    #[must_use]
    pub fn with_isa(self, isa: Isa) -> Self {
        if isa.is_available() { Self { isa, ..self } } else { self }
    }

    /// The instruction set in use.
    #[must_use]
    pub fn isa(&self) -> Isa {
        self.isa
    }

    /// The nearest hit with `0 < t < ray.t_max`: the smallest (t, instance, geometry, primitive), static geometry
    /// counting as the last instance.
    ///
    /// `filter` is asked about hits on geometries that [need it](crate::Geometry::needs_filter), in no particular order
    /// and perhaps in vain; it must depend on nothing but the hit. Pass [`accept_all`](crate::accept_all) for none.
    #[inline]
    pub fn intersect(&self, ray: &Ray, filter: &mut impl FnMut(&Hit) -> bool) -> Option<Hit> {
        kernels::nearest(self, ray, filter)
    }

    /// Is there a hit with `0 < t < ray.t_max`? `filter` as for [`Accel::intersect`].
    #[inline]
    pub fn occluded(&self, ray: &Ray, filter: &mut impl FnMut(&Hit) -> bool) -> bool {
        kernels::any(self, ray, filter)
    }

    /// [`Accel::intersect`] for each ray: the same bits, sooner. Rays that stand one beside the other and go the same way are
    /// traced together, so keep the rays of a tile, or of a lamp, in one batch and in order.
    ///
    /// `filter` is also told the ray's index; pass [`accept_all_of`](crate::accept_all_of) for none. If there are fewer places for hits than
    /// rays, the other rays are left out.
    pub fn intersect_many(
        &self,
        rays: &[Ray],
        hits: &mut [Option<Hit>],
        filter: &mut dyn FnMut(usize, &Hit) -> bool,
    ) {
        let n = rays.len().min(hits.len());
        kernels::nearest_many(self, &rays[..n], &mut hits[..n], filter);
    }

    /// [`Accel::occluded`] for each ray, as [`Accel::intersect_many`].
    pub fn occluded_many(
        &self,
        rays: &[Ray],
        blocked: &mut [bool],
        filter: &mut dyn FnMut(usize, &Hit) -> bool,
    ) {
        let n = rays.len().min(blocked.len());
        kernels::any_many(self, &rays[..n], &mut blocked[..n], filter);
    }

    #[inline(always)]
    pub(crate) fn hit(&self, best: &Best) -> Hit {
        if best.instance == NO_INSTANCE {
            return self.world.hit(best);
        }
        self.objects[self.placed[best.instance as usize].object as usize].hit(best)
    }

    /// The box around everything, over all time.
    #[must_use]
    pub fn bounds(&self) -> Bounds {
        self.bounds
    }

    /// The static geometry.
    #[must_use]
    pub fn world(&self) -> &Blas {
        &self.world
    }

    /// Bytes in memory.
    #[must_use]
    pub fn memory(&self) -> usize {
        self.world.memory()
            + self.objects.iter().map(Blas::memory).sum::<usize>()
            + self.placed.len() * size_of::<Placed>()
            + self.top.nodes.len() * size_of::<Node>()
    }

    /// What it consists of.
    #[must_use]
    pub fn stats(&self) -> AccelStats {
        let mut all = AccelStats {
            objects: self.objects.len(),
            instances: self.placed.len(),
            nodes: self.top.nodes.len(),
            bytes: self.memory(),
            ..AccelStats::default()
        };
        for blas in std::iter::once(&self.world).chain(&self.objects) {
            let s = blas.stats();
            all.triangles += s.triangles;
            all.others += s.others;
            all.skipped += s.skipped;
            all.nodes += s.nodes;
        }
        all
    }
}
