//! A sketch: every so many pixels a sample of the first pass, so that there is something to look at before that pass is complete.

use film::{Film, FilmSettings, Filter};
use image::Image;
use integrators::{Cell, CellOutput, Counters};
use math::Bounds2i;
use rayon::prelude::*;

use crate::job::Job;
use crate::{Error, Workers};

impl Job<'_> {
    /// One sample of pass 0 for each square of `step` pixels, as a small picture of linear R, G, B. The film is not changed. `None`
    /// for a method that prepares its passes or whose light comes from light paths: it has nothing quick to show.
    ///
    /// # Errors
    /// No memory.
    pub fn sketch(&self, step: u32, workers: &Workers) -> Result<Option<Image>, Error> {
        let bound = self.bound();
        if bound.prepares() || bound.light_blocks() > 0 {
            return Ok(None);
        }
        let settings = self.film().settings();
        let (crop, step) = (settings.crop, step.max(1) as usize);
        let size = [crop.width().div_ceil(step), crop.height().div_ceil(step)];
        let film = Film::new(FilmSettings { filter: Filter::pixel_box(), ..settings.clone() })?;
        let new_output =
            || CellOutput { tile: film.tile(), splats: film.splat_list(), counters: Counters::default() };
        let sample = |out: &mut CellOutput, i: usize| {
            // The middle of the square, or of what the crop has of it.
            let middle = |k: usize, n: usize| ((k * step + (k * step + step).min(n)) / 2) as i32;
            let at = [middle(i % size[0], crop.width()), middle(i / size[0], crop.height())];
            let pixel = [crop.min[0] + at[0], crop.min[1] + at[1]];
            let cell = Bounds2i::new(pixel, pixel.map(|x| x + 1));
            out.tile.begin(cell, 0);
            out.splats.begin(0);
            bound.cell(0, Cell::Tile(cell), out);
            out.tile.mean(pixel)
        };
        let pixels: Vec<[f32; 3]> = workers.install(|| {
            let squares = (0..size[0] * size[1]).into_par_iter();
            squares.map_init(new_output, sample).collect()
        });
        let names = ["R", "G", "B"].map(str::to_owned).to_vec();
        let picture = Image::from_data(size[0], size[1], names, pixels.into_flattened());
        Ok(picture.ok())
    }
}
