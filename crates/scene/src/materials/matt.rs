//! Which materials are matt, so that sixteen paths at them can share their work.

use scatter::Bsdf;
use spectrum::Spectrum;

use super::look::Look;
use super::{Material, Materials, Relief, Surface};
use crate::MaterialId;

/// Is a material matt: does it reflect by Lambert's law alone?
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Matt {
    /// It is not, or not surely.
    No,
    /// Wherever it is looked up.
    Varying,
    /// With this reflectance on the side of the normal and on the other, everywhere, in the frame of the form.
    Constant([Spectrum; 2]),
}

impl Materials {
    /// Is it matt?
    #[inline]
    pub(crate) fn matt(&self, id: MaterialId) -> &Matt {
        &self.matt[id.index()]
    }
}

/// Which of the materials are matt.
pub(super) fn matt_ones(list: &[Material]) -> Vec<Matt> {
    let of_one = |m: &Material| match (&m.surface, &m.constant, m.relief) {
        (Surface::Look(_), Some(Bsdf::Diffuse(d)), Relief::None) => Matt::Constant([d.reflectance(); 2]),
        (Surface::Look(Look::Diffuse { .. }), ..) => Matt::Varying,
        (Surface::Look(_) | Surface::Mix { .. } | Surface::TwoSided { .. }, ..) => Matt::No,
        (Surface::Pane(_) | Surface::Interface, ..) => Matt::No,
    };
    let of_side = |id: &MaterialId| list.get(id.index()).map_or(Matt::No, of_one);
    let of = |m: &Material| match &m.surface {
        Surface::TwoSided { front, back } => match (of_side(front), of_side(back)) {
            (Matt::Constant([front, _]), Matt::Constant([_, back])) => Matt::Constant([front, back]),
            (Matt::No, _) | (_, Matt::No) => Matt::No,
            (Matt::Varying | Matt::Constant(_), _) => Matt::Varying,
        },
        Surface::Look(_) | Surface::Mix { .. } | Surface::Pane(_) | Surface::Interface => of_one(m),
    };
    list.iter().map(of).collect()
}
