//! `steradian diff`.

use std::path::Path;

use lab::Metrics;
use serde::Serialize;

use crate::args::DiffArgs;
use crate::exit::{Done, Failure, Status};
use crate::messages;

#[derive(Debug, Serialize)]
struct Report<'a> {
    a: &'a Path,
    b: &'a Path,
    width: usize,
    height: usize,
    #[serde(flatten)]
    metrics: Metrics,
    /// Thresholds that were exceeded.
    failed: Vec<String>,
}

pub(crate) fn run(args: &DiffArgs) -> Done {
    let (a, b) = (load(&args.a)?, load(&args.b)?);
    let size = |p: &Picture| format!("{} x {}", p.size[0], p.size[1]);
    if a.size != b.size {
        return Err(Failure::input(format!(
            "{} has {} pixels, {} has {}",
            args.a.display(),
            size(&a),
            args.b.display(),
            size(&b)
        )));
    }
    let mut metrics = lab::compare(&a.rgb, &b.rgb).map_err(Failure::input)?;
    let errors = match a.is_float || b.is_float {
        true => lab::flip::flip_hdr(&a.rgb, &b.rgb, a.size[0]),
        false => lab::flip::flip_ldr(&a.rgb, &b.rgb, a.size[0]),
    };
    metrics.flip = Some(lab::flip::mean(&errors));
    if let Some(path) = &args.map {
        save_map(path, &errors, a.size)?;
    }
    if metrics.non_finite > 0 {
        messages::warning(&format!("{} pixels are not finite and are left out", metrics.non_finite));
    }

    let failed = failed(args, &metrics);
    let [width, height] = a.size;
    if args.json {
        messages::json(&Report { a: &args.a, b: &args.b, width, height, metrics, failed: failed.clone() });
    } else {
        print(&metrics);
    }
    failed.iter().for_each(|sentence| messages::error(sentence));
    Ok(if failed.is_empty() { Status::Done } else { Status::No })
}

pub(crate) struct Picture {
    pub(crate) size: [usize; 2],
    pub(crate) rgb: Vec<[f32; 3]>,
    /// Variance of each value, if the file has the layer.
    pub(crate) variance: Option<Vec<[f32; 3]>>,
    /// May it hold more than a screen shows?
    is_float: bool,
}

/// Linear R, G, B; pictures of eight bits are decoded from sRGB.
pub(crate) fn load(path: &Path) -> Result<Picture, Failure> {
    let refuse = |e: image::ImageError| {
        let e = anyhow::Error::from(e);
        let named = e.to_string().contains(&*path.to_string_lossy());
        Failure::Input(if named { e } else { e.context(path.display().to_string()) })
    };
    let whole = image::load_image(path).map_err(refuse)?;
    let variance = variance(&whole);
    let image = whole.to_rgb().map_err(refuse)?;
    let rgb = image.data().chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect();
    let is_float = !matches!(
        image::Format::of_path(path),
        Some(image::Format::Png | image::Format::Jpeg | image::Format::Tga | image::Format::Bmp)
    );
    Ok(Picture { size: [image.width(), image.height()], rgb, variance, is_float })
}

/// The layer that `steradian render` writes beside the picture.
fn variance(image: &image::Image) -> Option<Vec<[f32; 3]>> {
    let mut channels = [0; 3];
    for (at, name) in channels.iter_mut().zip(["variance.R", "variance.G", "variance.B"]) {
        *at = image.channel(name)?;
    }
    let n = image.channels().len();
    Some(image.data().chunks_exact(n).map(|p| channels.map(|c| p[c])).collect())
}

/// Where the difference is seen: FLIP errors, as colours in pictures of eight bits, as numbers in others.
fn save_map(path: &Path, errors: &[f32], [width, height]: [usize; 2]) -> Result<(), Failure> {
    render::check_writable(path)?;
    let is_eight_bit = matches!(image::Format::of_path(path), Some(image::Format::Png));
    let color = |&e: &f32| match is_eight_bit {
        true => lab::flip::magma(e).map(|c| image::TransferFunction::Srgb.decode(c)),
        false => [e; 3],
    };
    let rgb = errors.iter().flat_map(color).collect();
    let channels = ["R", "G", "B"].map(str::to_owned).to_vec();
    let map = image::Image::from_data(width, height, channels, rgb).map_err(Failure::failed)?;
    Ok(render::save_picture(path, &map, 0.0)?)
}

/// A sentence for each threshold that is exceeded. What cannot be compared fails any threshold.
fn failed(args: &DiffArgs, metrics: &Metrics) -> Vec<String> {
    let mut failed: Vec<String> = args
        .fail_above
        .iter()
        .map(|&(metric, limit)| (metric, metric.of(metrics), limit))
        .filter(|(_, value, limit)| value.is_nan() || value > limit)
        .map(|(metric, value, limit)| format!("{metric} is {value:.6e}, above {limit}"))
        .collect();
    if !args.fail_above.is_empty() && metrics.non_finite > 0 {
        failed.push(format!("{} pixels are not finite", metrics.non_finite));
    }
    failed
}

fn print(m: &Metrics) {
    for metric in lab::Metric::ALL {
        messages::say(&format!("{:<16}{:.6e}", metric.name(), metric.of(m)));
    }
    let rgb = |v: [f64; 3]| format!("{:.6} {:.6} {:.6}", v[0], v[1], v[2]);
    messages::say(&format!("{:<16}{}", "mean", rgb(m.mean)));
    messages::say(&format!("{:<16}{}", "mean reference", rgb(m.mean_reference)));
    let ratio = [0, 1, 2].map(|c| m.mean[c] / m.mean_reference[c]);
    messages::say(&format!("{:<16}{}", "ratio", rgb(ratio)));
}
