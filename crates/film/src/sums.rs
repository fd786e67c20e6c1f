//! The sums of one block of a film. A block without passes has none, and one of a single pass keeps what that gave.

use std::borrow::Cow;

use math::Bounds2i;

use crate::blocks::Block;
use crate::column::Column;
use crate::fixed::{Fixed, Moment, weight};
use crate::pass::PassSums;
use crate::tile::Common;

/// One block.
pub(crate) struct FilmBlock {
    pub(crate) area: Bounds2i,
    pub(crate) held: Held,
}

/// What a block holds.
#[derive(Clone)]
pub(crate) enum Held {
    /// Zeros.
    Nothing,
    /// What one pass gave: all sums follow from it.
    One(Box<PassSums>),
    /// Sums over passes.
    Many(Box<Sums>),
}

/// The sums of one block, those of a pixel next to each other. What the settings do not need is empty.
#[derive(Clone, Debug)]
pub(crate) struct Sums {
    /// ΣT.
    pub(crate) total: Column<64>,
    /// ΣT².
    pub(crate) total_squared: Column<48>,
    /// ΣB.
    pub(crate) weight: Vec<i64>,
    /// ΣB².
    pub(crate) weight_squared: Vec<i64>,
    /// ΣTB.
    pub(crate) total_weight: Column<48>,
    /// ΣS.
    pub(crate) splat: Column<64>,
    /// Σ w x of the further channels, pixel by pixel.
    pub(crate) aovs: Column<64>,
    /// Σ x of the splats' further channels, pixel by pixel.
    pub(crate) splat_aovs: Column<64>,
}

impl Block for FilmBlock {
    fn area(&self) -> Bounds2i {
        self.area
    }
}

impl FilmBlock {
    /// The sums; none if they are all zero.
    pub(crate) fn sums(&self, common: &Common) -> Option<Cow<'_, Sums>> {
        match &self.held {
            Held::Nothing => None,
            Held::One(pass) => Some(Cow::Owned(Sums::of_one(common, self.area.area(), pass))),
            Held::Many(sums) => Some(Cow::Borrowed(sums)),
        }
    }

    /// The sums, to be added to.
    pub(crate) fn sums_mut(&mut self, common: &Common) -> &mut Sums {
        let n = self.area.area();
        let many = match std::mem::replace(&mut self.held, Held::Nothing) {
            Held::Nothing => Box::new(Sums::zeros(common, n)),
            Held::One(pass) => Box::new(Sums::of_one(common, n, &pass)),
            Held::Many(sums) => sums,
        };
        self.held = Held::Many(many);
        match &mut self.held {
            Held::Many(sums) => sums,
            Held::Nothing | Held::One(_) => unreachable!("it was just made so"),
        }
    }
}

impl Sums {
    /// Of `n` pixels.
    fn zeros(common: &Common, n: usize) -> Self {
        let n_weighted = if common.is_pixel_box { 0 } else { n };
        let n_splat = if common.has_splats { n_weighted } else { 0 };
        Self {
            total: Column::zeros(3 * n),
            total_squared: Column::zeros(3 * n),
            weight: vec![0; n_weighted],
            weight_squared: vec![0; n_weighted],
            total_weight: Column::zeros(3 * n_weighted),
            splat: Column::zeros(3 * n_splat),
            aovs: Column::zeros(n * common.n_aovs),
            splat_aovs: Column::zeros(n * common.n_splat_aovs),
        }
    }

    fn of_one(common: &Common, n: usize, pass: &PassSums) -> Self {
        let mut sums = Self::zeros(common, n);
        sums.add_replicate(pass);
        sums
    }

    /// Adds what one pass gives to the pixels of this block.
    pub(crate) fn add_replicate(&mut self, pass: &PassSums) {
        for i in 0..pass.total.len() / 3 {
            let totals = pass.total.get3(3 * i);
            self.add_total(i, &totals);
            let Some(&w) = pass.weight.get(i) else { continue };
            let b = weight::to_f64(w);
            self.weight[i] = self.weight[i].wrapping_add(w);
            self.weight_squared[i] = self.weight_squared[i].wrapping_add(weight::from_f64(b * b));
            for (c, total) in totals.into_iter().enumerate() {
                let product = Moment::from_f64(total.to_f64() * b).unwrap_or(Moment::MAX);
                self.total_weight.add(3 * i + c, product);
            }
        }
        self.splat.add_all(&pass.splat);
        self.aovs.add_all(&pass.aovs);
        self.splat_aovs.add_all(&pass.splat_aovs);
    }

    /// T and T² of one pass. Squares that do not fit saturate, which is the same in any order.
    #[inline]
    pub(crate) fn add_total(&mut self, i: usize, total: &[Fixed; 3]) {
        for (c, &x) in total.iter().enumerate() {
            self.total.add(3 * i + c, x);
            let t = x.to_f64();
            let square = Moment::from_f64(t * t).unwrap_or(Moment::MAX);
            self.total_squared.add_saturating(3 * i + c, square);
        }
    }

    pub(crate) fn merge(&mut self, other: &Self) {
        self.total.add_all(&other.total);
        self.total_squared.add_all_saturating(&other.total_squared);
        add_weights(&mut self.weight, &other.weight);
        add_weights(&mut self.weight_squared, &other.weight_squared);
        self.total_weight.add_all(&other.total_weight);
        self.splat.add_all(&other.splat);
        self.aovs.add_all(&other.aovs);
        self.splat_aovs.add_all(&other.splat_aovs);
    }
}

fn add_weights(sums: &mut [i64], values: &[i64]) {
    sums.iter_mut().zip(values).for_each(|(sum, x)| *sum = sum.wrapping_add(*x));
}
