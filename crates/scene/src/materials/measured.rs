//! Measured surfaces: the tensor files of the RGL data base, made into tables for a render's colours.
//!
//! | step                    | source                                                                           |
//! |-------------------------|----------------------------------------------------------------------------------|
//! | fields and their shapes | [Dupuy2018], the data base's readers                                             |
//! | spectra to R, G and B   | each under the white of the film's space: a sum over the file's wavelengths      |
//! | R, G, B to spectra      | our upsampling, at 16 wavelengths                                                |
//!
//! Spectral mode drops the wavelengths that no path carries. Left out: polarised files.

mod tensor;

use std::path::Path;
use std::sync::Arc;

use scatter::{Bsdf, Measured, MeasuredParts, MeasuredTable, Raster};
use spectrum::{
    ColorMode, ColorPipeline, ColorSpace, LAMBDA_MAX, LAMBDA_MIN, RgbToSpectrumTable, SpectralCurve,
    Wavelengths,
};

use self::tensor::TensorFile;

/// A measured surface, ready for a render.
#[derive(Clone, Debug)]
pub(super) struct MeasuredLook {
    table: Arc<MeasuredTable>,
    /// Wavelengths of its channels in nm; none in RGB mode.
    lambda: Arc<[f32]>,
}

/// Wavelengths at which colours are spread over the spectrum.
const N_UPSAMPLED: usize = 16;

impl MeasuredLook {
    /// Reads a file.
    ///
    /// # Errors
    ///
    /// What is wrong, with the field.
    pub(super) fn read(path: &Path, colors: ColorPipeline) -> Result<Self, String> {
        let bytes = match std::fs::metadata(path) {
            Ok(m) if m.is_file() => std::fs::read(path).map_err(|e| e.to_string())?,
            Ok(_) => return Err("not a regular file".into()),
            Err(e) => return Err(e.to_string()),
        };
        Self::decode(&bytes, colors)
    }

    fn decode(bytes: &[u8], colors: ColorPipeline) -> Result<Self, String> {
        let file = TensorFile::parse(bytes)?;
        let axis = |name| file.field(name)?.shaped::<1>().and_then(|f| f.floats());
        let (phi_i, theta_i) = (axis("phi_i")?, axis("theta_i")?);
        let single = |name| {
            let field = file.field(name)?;
            let [h, w] = field.shape()?;
            Ok::<_, String>(Raster { size: [w, h], values: field.floats()? })
        };
        let sliced = |name| {
            let field = file.field(name)?;
            let [phi, theta, h, w] = field.shape()?;
            field
                .expect(phi == phi_i.len() && theta == theta_i.len(), "is not of as many slices as angles")?;
            Ok::<_, String>(Raster { size: [w, h], values: field.floats()? })
        };
        let jacobian = file.field("jacobian")?.bytes()?.first().is_some_and(|b| *b != 0);
        let channels = Channels::of(&file, [phi_i.len(), theta_i.len()])?.for_render(colors)?;
        let parts = MeasuredParts {
            ndf: single("ndf")?,
            sigma: single("sigma")?,
            vndf: sliced("vndf")?,
            luminance: sliced("luminance")?,
            spectra: channels.raster,
            n_channels: channels.n,
            jacobian,
            phi_i,
            theta_i,
        };
        let table = MeasuredTable::new(parts).map_err(|e| format!("field \"{}\" {}", e.field, e.what))?;
        Ok(Self { table: Arc::new(table), lambda: channels.lambda.into() })
    }

    /// The surface as a path sees it.
    pub(super) fn bsdf(&self, wl: &Wavelengths) -> Bsdf {
        let channels = match self.lambda.is_empty() {
            // The fourth lane carries nothing.
            true => [0.0, 1.0, 2.0, 1.0],
            false => wl.lambda().map(|l| position(&self.lambda, l)),
        };
        Measured::new(Arc::clone(&self.table), channels).into()
    }
}

/// Where between the numbers of an ascending list `x` lies, as an index with a fraction.
fn position(list: &[f32], x: f32) -> f32 {
    let i = list.partition_point(|l| *l <= x);
    match (i.checked_sub(1).and_then(|i| list.get(i)), list.get(i)) {
        (Some(low), Some(high)) => (i - 1) as f32 + (x - low) / (high - low),
        (None, _) => 0.0,
        (_, None) => (list.len() - 1) as f32,
    }
}

/// What was measured: slices of φ, θ and channel.
struct Channels {
    raster: Raster,
    n: usize,
    /// In nm; empty for linear sRGB.
    lambda: Vec<f32>,
}

impl Channels {
    fn of(file: &TensorFile<'_>, angles: [usize; 2]) -> Result<Self, String> {
        let (field, lambda) = match file.find("spectra") {
            Some(spectra) => (spectra, file.field("wavelengths")?.shaped::<1>()?.floats()?),
            None => (file.find("rgb").ok_or("has neither a field \"spectra\" nor \"rgb\"")?, Vec::new()),
        };
        let [phi, theta, n, h, w] = field.shape()?;
        field.expect([phi, theta] == angles, "is not of as many slices as angles")?;
        if lambda.is_empty() {
            field.expect(n == 3, "does not have three channels")?;
        } else {
            field.expect(n == lambda.len(), "is not of as many channels as wavelengths")?;
            let ascends = lambda.windows(2).all(|l| l[0] < l[1]) && lambda.iter().all(|l| l.is_finite());
            if !ascends {
                return Err("field \"wavelengths\" must be finite and ascending".into());
            }
        }
        Ok(Self { raster: Raster { size: [w, h], values: field.floats()? }, n, lambda })
    }

    /// As many as a render needs: R, G and B of its space, or those that its paths carry.
    fn for_render(self, colors: ColorPipeline) -> Result<Self, String> {
        match (colors.mode, self.lambda.is_empty()) {
            (ColorMode::Rgb, true) => Ok(self.mixed(&primaries(colors.space), Vec::new())),
            (ColorMode::Rgb, false) => {
                let rows = self.lambda_to_rgb(colors.space)?;
                Ok(self.mixed(&rows, Vec::new()))
            }
            (ColorMode::Spectral, true) => Ok(self.upsampled()),
            (ColorMode::Spectral, false) => Ok(self.visible()),
        }
    }

    /// What each of the file's wavelengths adds to R, G and B.
    fn lambda_to_rgb(&self, space: ColorSpace) -> Result<Vec<[f32; 3]>, String> {
        let n = self.lambda.len();
        let hat = |i: usize| {
            let mut points = Vec::new();
            // Beyond its ends a spectrum stays what it is there.
            if i == 0 {
                points.extend([self.lambda[0].min(LAMBDA_MIN) - 1.0, 1.0]);
            } else {
                points.extend([self.lambda[i - 1], 0.0]);
            }
            points.extend([self.lambda[i], 1.0]);
            if i + 1 == n {
                points.extend([self.lambda[i].max(LAMBDA_MAX) + 1.0, 1.0]);
            } else {
                points.extend([self.lambda[i + 1], 0.0]);
            }
            SpectralCurve::from_interleaved(&points)
                .map(|c| c.reflectance_rgb(space))
                .map_err(|e| format!("field \"wavelengths\": {e}"))
        };
        (0..n).map(hat).collect()
    }

    /// Three channels, each a sum of all with these weights; `weights[channel][of R, G, B]`.
    fn mixed(&self, weights: &[[f32; 3]], lambda: Vec<f32>) -> Self {
        let size = self.raster.size;
        let nodes = size[0] * size[1];
        let slices = self.raster.values.len() / (nodes * self.n).max(1);
        let mut values = vec![0.0; slices * 3 * nodes];
        let old = self.raster.values.chunks_exact((nodes * self.n).max(1));
        for (new, old) in values.chunks_exact_mut((3 * nodes).max(1)).zip(old) {
            for (channel, weights) in old.chunks_exact(nodes).zip(weights) {
                for (k, weight) in weights.iter().enumerate() {
                    for (sum, value) in new[k * nodes..][..nodes].iter_mut().zip(channel) {
                        *sum += weight * value;
                    }
                }
            }
        }
        Self { raster: Raster { size, values }, n: 3, lambda }
    }

    /// The channels that paths carry, and one more at either end.
    fn visible(self) -> Self {
        let first = self.lambda.partition_point(|l| *l <= LAMBDA_MIN).saturating_sub(1);
        let end = (self.lambda.partition_point(|l| *l < LAMBDA_MAX) + 1).clamp(first + 1, self.n);
        let nodes = self.raster.size[0] * self.raster.size[1];
        let slices = self.raster.values.chunks_exact((nodes * self.n).max(1));
        let values = slices.flat_map(|s| s[first * nodes..end * nodes].iter().copied()).collect();
        let raster = Raster { size: self.raster.size, values };
        Self { raster, n: end - first, lambda: self.lambda[first..end].to_vec() }
    }

    /// Spectra of R, G and B.
    fn upsampled(self) -> Self {
        let step = (LAMBDA_MAX - LAMBDA_MIN) / (N_UPSAMPLED - 1) as f32;
        let lambda: Vec<f32> = (0..N_UPSAMPLED).map(|i| LAMBDA_MIN + step * i as f32).collect();
        let nodes = self.raster.size[0] * self.raster.size[1];
        let mut values = Vec::with_capacity(self.raster.values.len() / 3 * N_UPSAMPLED);
        let table = RgbToSpectrumTable::of(ColorSpace::Srgb);
        for slice in self.raster.values.chunks_exact((3 * nodes).max(1)) {
            let colors: Vec<_> = (0..nodes)
                .map(|i| table.unbounded([0, 1, 2].map(|k| slice[k * nodes + i].max(0.0))))
                .collect();
            for l in &lambda {
                values.extend(colors.iter().map(|(scale, sigmoid)| scale * sigmoid.eval(*l)));
            }
        }
        Self { raster: Raster { size: self.raster.size, values }, n: N_UPSAMPLED, lambda }
    }
}

/// What linear sRGB's primaries are in another space.
fn primaries(space: ColorSpace) -> [[f32; 3]; 3] {
    [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|rgb| ColorSpace::Srgb.convert(space, rgb))
}

#[cfg(test)]
mod tests {
    use super::*;
    use math::{LocalDir, Vec3};
    use scatter::{BsdfKind, Conductor, TransportMode};
    use spectrum::Spectrum;

    const RGB: ColorPipeline = ColorPipeline::new(ColorMode::Rgb, ColorSpace::Srgb);
    const SPECTRAL: ColorPipeline = ColorPipeline::new(ColorMode::Spectral, ColorSpace::Srgb);

    /// A grey metal, whose channels are these times its reflection.
    fn parts<const C: usize>(factors: [f32; C]) -> MeasuredParts {
        let metal = Conductor::new(Spectrum::splat(0.2), Spectrum::splat(3.5), [0.5; 2]);
        let f = |wo, wi| metal.eval(wo, wi, TransportMode::Radiance).lanes()[0];
        testkit::measured::tabulate([0.5; 2], true, |wo, wi| {
            factors.map(|k| k * f(wo, wi) * wi.abs_cos_theta())
        })
        .unwrap()
    }

    fn f(look: &MeasuredLook, wl: &Wavelengths) -> Spectrum {
        let (wo, wi) = (Vec3::new(0.3, 0.2, 0.9), Vec3::new(-0.4, 0.1, 0.8));
        let [wo, wi] = [wo, wi].map(LocalDir::normalize);
        look.bsdf(wl).eval(wo, wi, TransportMode::Radiance)
    }

    #[test]
    fn spectra_and_colours_come_to_the_same_in_both_modes() {
        // A line through 360, 600 and 830 nm.
        let lambda = [360.0, 600.0, 830.0];
        let spectral = testkit::measured::file(&parts([0.2, 0.5, 0.8]), &lambda);
        let curve = SpectralCurve::from_interleaved(&[360.0, 0.2, 600.0, 0.5, 830.0, 0.8]).unwrap();
        let rgb = curve.reflectance_rgb(ColorSpace::Srgb);
        let colored = testkit::measured::file(&parts(rgb), &[]);
        let grey = MeasuredLook::decode(&testkit::measured::file(&parts([1.0; 3]), &[]), RGB).unwrap();
        let one = f(&grey, &Wavelengths::RGB).lanes()[0];

        for bytes in [&spectral, &colored] {
            let look = MeasuredLook::decode(bytes, RGB).unwrap();
            for (found, expected) in f(&look, &Wavelengths::RGB).rgb().into_iter().zip(rgb) {
                assert!((found / one - expected).abs() < 2e-3, "{found} over {one} is not {expected}");
            }
        }
        let look = MeasuredLook::decode(&spectral, SPECTRAL).unwrap();
        let wl = Wavelengths::new([370.0, 480.0, 600.0, 815.0], [1.0; 4]);
        for (found, l) in f(&look, &wl).lanes().into_iter().zip(wl.lambda()) {
            assert!((found / one - curve.eval(l)).abs() < 1e-3, "{found} at {l} nm");
        }
        // Upsampled colours are smooth spectra of the same colour: near to a line.
        let look = MeasuredLook::decode(&colored, SPECTRAL).unwrap();
        let table = RgbToSpectrumTable::of(ColorSpace::Srgb).coefficients(rgb);
        for (found, l) in f(&look, &wl).lanes().into_iter().zip(wl.lambda()) {
            assert!((found / one - table.eval(l)).abs() < 6e-3, "{found} at {l} nm");
        }
    }

    #[test]
    fn wavelengths_that_no_path_carries_are_dropped() {
        let lambda = [300.0, 340.0, 500.0, 900.0, 1000.0];
        let bytes = testkit::measured::file(&parts([9.0, 0.5, 0.5, 0.5, 9.0]), &lambda);
        let look = MeasuredLook::decode(&bytes, SPECTRAL).unwrap();
        assert_eq!(look.lambda.as_ref(), [340.0, 500.0, 900.0]);
        assert_eq!([330.0, 420.0, 700.0, 950.0].map(|l| position(&look.lambda, l)), [0.0, 0.5, 1.5, 2.0]);
    }

    #[test]
    fn broken_files_say_what_is_broken() {
        let good = testkit::measured::file(&parts([1.0; 3]), &[]);
        let error = |bytes: &[u8]| MeasuredLook::decode(bytes, RGB).unwrap_err();
        assert!(error(b"PNG").starts_with("not a tensor file"));
        assert_eq!(error(&good[..40]), "the file ends in its header");
        assert_eq!(error(&good[..good.len() - 4]), "field \"rgb\" ends beyond the end of the file");
        let mut version = good.clone();
        version[12] = 7;
        assert_eq!(error(&version), "of version 7.0; version 1.0 is known");
        // Any prefix is an error, none panics.
        for n in (0..400).chain((400..good.len()).step_by(9973)) {
            error(&good[..n]);
        }

        let broken = |change: fn(&mut MeasuredParts)| {
            let mut parts = parts([1.0; 3]);
            change(&mut parts);
            error(&testkit::measured::file(&parts, &[]))
        };
        assert_eq!(broken(|p| p.theta_i[3] = 0.0), "field \"theta_i\" must be finite and ascending");
        assert_eq!(broken(|p| p.ndf.values[5] = f32::NAN), "field \"ndf\" holds NaN");
        assert_eq!(broken(|p| p.vndf.values[5] = -1.0), "field \"vndf\" holds -1");
        assert_eq!(broken(|p| p.n_channels = 2), "field \"rgb\" does not have three channels");
        let none = testkit::measured::tensor_file(&[("phi_i", 10, vec![1], vec![0; 4])]);
        assert_eq!(error(&none), "has no field \"theta_i\"");
        let huge = testkit::measured::tensor_file(&[("phi_i", 10, vec![usize::MAX >> 1], vec![0; 4])]);
        assert_eq!(error(&huge), "field \"phi_i\" ends beyond the end of the file");
        let bytes = testkit::measured::tensor_file(&[("phi_i", 1, vec![1], vec![0; 4])]);
        assert_eq!(error(&bytes), "field \"phi_i\" is not of 32-bit floats");
        let flat = testkit::measured::tensor_file(&[("phi_i", 10, vec![1, 1], vec![0; 4])]);
        assert_eq!(error(&flat), "field \"phi_i\" has 2 dimensions, not 1");
    }
}
