//! `steradian diff`.

use std::path::Path;

use lab::{Metrics, Picture};
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
    let load = |path| Picture::load(path).map_err(Failure::input);
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
    let errors = lab::flip::between(&a, &b);
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
