//! `show=strategies`: the image that every strategy makes, with its weights and without them. Arranged by the length of
//! paths it is the pyramid of [Veach1997, sec. 10.2].

use film::{FilmTile, SplatList};

use crate::{Channels, StrategyLayer};

/// Channels of a strategy: R, G, B weighted, then unweighted.
const PER_STRATEGY: usize = 6;

/// Which strategy fills which channels.
pub(crate) struct Layers {
    /// Most scattering events of the paths that are shown.
    depth: usize,
    /// First channel of (s, t), at s (depth + 3) + t, among those of camera samples or of splats; `None`: no such
    /// strategy.
    first: Vec<Option<usize>>,
    channels: Channels,
}

/// The camera samples' channels of one pixel, in the making.
#[derive(Debug, Default)]
pub(super) struct LayerSample(Vec<f32>);

/// Is its value radiance at the camera sample's place, or a splat elsewhere on the film?
fn is_splat(t: usize) -> bool {
    t <= 1
}

impl Layers {
    /// For paths of up to `depth` scattering events.
    pub(super) fn new(depth: usize, has_lens: bool) -> Self {
        let side = depth + 3;
        let mut layers = Self { depth, first: vec![None; side * side], channels: Channels::default() };
        for n in 2..=depth + 2 {
            for s in 0..=n {
                let t = n - s;
                // (1, 1) is left to (0, 2); rays find a lens of finite size alone.
                if (s, t) == (1, 1) || (t == 0 && !has_lens) {
                    continue;
                }
                let Channels { samples, splats } = &mut layers.channels;
                let names = if is_splat(t) { splats } else { samples };
                layers.first[s * side + t] = Some(names.len());
                for is_weighted in [true, false] {
                    let name = StrategyLayer { s, t, is_weighted }.name();
                    names.extend(["R", "G", "B"].map(|c| format!("{name}.{c}")));
                }
            }
        }
        layers
    }

    pub(super) fn channels(&self) -> Channels {
        self.channels.clone()
    }

    fn first(&self, s: usize, t: usize) -> Option<usize> {
        if s + t > self.depth + 2 { None } else { self.first[s * (self.depth + 3) + t] }
    }

    /// A pixel begins.
    pub(super) fn begin(&self, sample: &mut LayerSample) {
        sample.0.clear();
        sample.0.resize(self.channels.samples.len(), 0.0);
    }

    /// What a strategy adds to the pixel, weighted and unweighted.
    pub(super) fn add(&self, sample: &mut LayerSample, (s, t): (usize, usize), values: [[f32; 3]; 2]) {
        if let Some(first) = self.first(s, t) {
            let sums = &mut sample.0[first..first + PER_STRATEGY];
            sums.iter_mut().zip(values.as_flattened()).for_each(|(sum, x)| *sum += x);
        }
    }

    /// What a strategy adds elsewhere on the film, weighted and unweighted.
    pub(super) fn splat(
        &self,
        splats: &mut SplatList,
        (s, t): (usize, usize),
        at: [f32; 2],
        values: [[f32; 3]; 2],
    ) {
        if let Some(first) = self.first(s, t) {
            splats.add_aov(first, at, values[0]);
            splats.add_aov(first + 3, at, values[1]);
        }
    }

    /// The pixel is done.
    pub(super) fn end(&self, sample: &LayerSample, tile: &mut FilmTile, pixel: [i32; 2], offset: [f32; 2]) {
        tile.add_aovs(pixel, offset, &sample.0);
    }
}
