//! What can be written on the command line: the contract of the design document, section 4.

use std::num::NonZero;
use std::ops::Range;
use std::path::PathBuf;
use std::time::Duration;

use clap::{Args, Parser, Subcommand};
use lab::Metric;
use lab::comparison::Entry;
use render::Precision;

/// Steradian: a physically based renderer.
#[derive(Debug, Parser)]
#[command(name = "steradian", version, max_term_width = 100, arg_required_else_help = true)]
pub(crate) struct Cli {
    #[command(subcommand)]
    pub(crate) command: Command,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Render a scene file to pictures
    Render(Box<RenderArgs>),
    /// Merge partial films of one render into a picture or a larger partial film
    Merge(MergeArgs),
    /// Show what is in a scene, what is unsupported, and how much memory it takes
    Info(InfoArgs),
    /// List the integrators: what each is for and misses, and its parameters with defaults
    Integrators(IntegratorsArgs),
    /// Compare a picture with a reference
    Diff(DiffArgs),
    /// Compare integrators on a scene at equal time or equal samples: figures, verdicts and a report
    Compare(Box<CompareArgs>),
    /// Run the experiments of docs/lecture.md: what the theory says, checked
    Lab(LabArgs),
    /// Say which integrator reaches an error soonest on a scene, by short pilots
    Advise(Box<AdviseArgs>),
    /// Write any scene as pbrt-v4, with meshes and images in a folder beside it
    Convert(crate::convert::ConvertArgs),
    /// Measure rays and paths per second on this machine
    Bench(BenchArgs),
    /// Walk one path again
    Replay(ReplayArgs),
}

/// What decides which scene is compiled.
#[derive(Debug, Args)]
pub(crate) struct SceneArgs {
    /// The scene file (.pbrt, .pbrt.gz, Mitsuba's .xml, .gltf or .glb)
    pub(crate) scene: PathBuf,
    /// Width and height in pixels, instead of the file's
    #[arg(long, value_name = "WxH", value_parser = resolution)]
    pub(crate) resolution: Option<[u32; 2]>,
    /// Pixels to render, first column and row, and one past the last
    #[arg(long, value_name = "X0,Y0,X1,Y1", value_parser = crop)]
    pub(crate) crop: Option<[i32; 4]>,
    /// Render wavelengths rather than R, G, B
    #[arg(long)]
    pub(crate) spectral: bool,
    /// Make every warning about the scene an error
    #[arg(long)]
    pub(crate) strict: bool,
    /// Give a $parameter of the scene file a value
    #[arg(short = 'D', value_name = "NAME=VALUE", value_parser = key_value)]
    pub(crate) define: Vec<(String, String)>,
    /// Use this many threads (default: all)
    #[arg(long, value_name = "N", value_parser = threads, allow_negative_numbers = true)]
    pub(crate) threads: Option<NonZero<usize>>,
    /// Use this instruction set for rays: scalar, avx2 or avx512 (default: the best there is)
    #[arg(long, value_name = "NAME", value_parser = isa)]
    pub(crate) isa: Option<accel::Isa>,
}

/// What decides how light is transported.
#[derive(Debug, Args)]
pub(crate) struct MethodArgs {
    /// Use this integrator instead of the file's; `steradian integrators` lists them
    #[arg(long, value_name = "NAME")]
    pub(crate) integrator: Option<String>,
    /// Set a parameter of the integrator, or `sampler`, or `light_selection`
    #[arg(long, value_name = "KEY=VALUE", value_parser = key_value)]
    pub(crate) set: Vec<(String, String)>,
    /// Seed of all randomness (default: the file's)
    #[arg(long, value_name = "N")]
    pub(crate) seed: Option<u64>,
}

#[derive(Debug, Args)]
pub(crate) struct RenderArgs {
    #[command(flatten)]
    pub(crate) scene: SceneArgs,
    #[command(flatten)]
    pub(crate) method: MethodArgs,
    /// Write the picture here: .exr, .png, .hdr or .pfm; may be repeated (default: the file's name, as .exr and .png)
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Vec<PathBuf>,
    /// Samples in each pixel (default: the file's)
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..), allow_negative_numbers = true, group = "stop")]
    pub(crate) spp: Option<u32>,
    /// Render for this long, such as 30s, 2m or 1.5h, to the last whole pass
    #[arg(long, value_name = "TIME", value_parser = duration, group = "stop")]
    pub(crate) time: Option<Duration>,
    /// Render until the relative error √relMSE is below this, with 95 % confidence, such as 1% (noise alone, not bias)
    #[arg(long, value_name = "E", value_parser = precision, group = "stop")]
    pub(crate) error: Option<Precision>,
    /// Render these passes only, half-open
    #[arg(long, value_name = "A..B", value_parser = passes, group = "stop")]
    pub(crate) passes: Option<Range<u32>>,
    /// Write the film's exact sums here, for `steradian merge`
    #[arg(long, value_name = "FILE")]
    pub(crate) partial: Option<PathBuf>,
    /// Save what is rendered here every so often
    #[arg(long, value_name = "FILE")]
    pub(crate) checkpoint: Option<PathBuf>,
    /// How often
    #[arg(long, value_name = "TIME", value_parser = duration, default_value = "30s", requires = "checkpoint")]
    pub(crate) checkpoint_every: Duration,
    /// Go on from the checkpoint, if it is there
    #[arg(long, requires = "checkpoint")]
    pub(crate) resume: bool,
    #[command(flatten)]
    pub(crate) farm: crate::cluster::FarmArgs,
    /// Brighten pictures of eight bits by this many stops
    #[arg(long, value_name = "EV", value_parser = stops, allow_negative_numbers = true, default_value_t = 0.0)]
    pub(crate) exposure: f32,
    /// Say nothing but warnings and errors
    #[arg(long)]
    pub(crate) quiet: bool,
    /// Print one JSON object at the end
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
pub(crate) struct MergeArgs {
    /// Partial films, as `render --partial` writes them
    #[arg(required = true, value_name = "PARTIAL")]
    pub(crate) partials: Vec<PathBuf>,
    /// A picture (.exr, .png, .hdr, .pfm), or any other name for a partial film; may be repeated
    #[arg(short, long, value_name = "FILE", required = true)]
    pub(crate) output: Vec<PathBuf>,
    /// Brighten pictures of eight bits by this many stops
    #[arg(long, value_name = "EV", value_parser = stops, allow_negative_numbers = true, default_value_t = 0.0)]
    pub(crate) exposure: f32,
    /// Print one JSON object at the end
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
pub(crate) struct InfoArgs {
    #[command(flatten)]
    pub(crate) scene: SceneArgs,
    /// Print one JSON object
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
pub(crate) struct IntegratorsArgs {
    /// Print one JSON object
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
pub(crate) struct DiffArgs {
    /// The picture
    pub(crate) a: PathBuf,
    /// The reference
    pub(crate) b: PathBuf,
    /// Exit with 1 if a metric is above a value; may be repeated
    #[arg(long, value_name = "METRIC=VALUE", value_parser = threshold)]
    pub(crate) fail_above: Vec<(Metric, f64)>,
    /// Write where the difference is seen here: FLIP errors, as colours (.png) or numbers (.exr, .pfm, .hdr)
    #[arg(long, value_name = "FILE")]
    pub(crate) map: Option<PathBuf>,
    /// Print one JSON object
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
pub(crate) struct CompareArgs {
    #[command(flatten)]
    pub(crate) scene: SceneArgs,
    /// The methods: NAME or NAME:KEY=VALUE:KEY=VALUE, with commas between them
    #[arg(long, value_name = "A,B,C", required = true, value_delimiter = ',', value_parser = entry)]
    pub(crate) integrators: Vec<Entry>,
    /// Let each run render for this long, such as 10s (default: 5s)
    #[arg(long, value_name = "TIME", value_parser = duration, group = "budget")]
    pub(crate) time: Option<Duration>,
    /// Let each run take so many samples in each pixel
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..), allow_negative_numbers = true, group = "budget")]
    pub(crate) spp: Option<u32>,
    /// Runs of each method, with different seeds: intervals come from their spread
    #[arg(long, value_name = "N", default_value = "3", value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) seeds: u32,
    /// The first seed
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(crate) seed: u64,
    /// The true picture (default: one is rendered and kept); EXR files may bring their variance
    #[arg(long, value_name = "FILE")]
    pub(crate) reference: Option<PathBuf>,
    /// The method that renders the reference, as in --integrators
    #[arg(long, value_name = "A", default_value = "path", value_parser = entry, conflicts_with = "reference")]
    pub(crate) reference_integrator: Entry,
    /// Render the reference until its estimated relMSE is below this
    #[arg(long, value_name = "X", default_value_t = 1e-4, conflicts_with = "reference")]
    pub(crate) reference_error: f64,
    /// But not longer than this
    #[arg(long, value_name = "TIME", value_parser = duration, default_value = "60s", conflicts_with = "reference")]
    pub(crate) reference_time: Duration,
    /// Keep references here (default: steradian/references in the user's cache folder)
    #[arg(long, value_name = "DIR")]
    pub(crate) cache: Option<PathBuf>,
    /// The folder for report.html, comparison.json and the pictures; it is made if it is not there
    #[arg(short, long, value_name = "DIR")]
    pub(crate) output: PathBuf,
    /// Say nothing but warnings and errors
    #[arg(long)]
    pub(crate) quiet: bool,
    /// Print all figures as one JSON object at the end
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
pub(crate) struct LabArgs {
    /// Experiments by name
    #[arg(value_name = "EXPERIMENT", required_unless_present_any = ["list", "all"])]
    pub(crate) experiments: Vec<String>,
    /// List the experiments
    #[arg(long)]
    pub(crate) list: bool,
    /// Run all of them
    #[arg(long, conflicts_with = "experiments")]
    pub(crate) all: bool,
    /// Runs of each method (default: as many as the experiment's claims need)
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..))]
    pub(crate) seeds: Option<u32>,
    /// Multiply the samples of each run with this
    #[arg(long, value_name = "X", default_value_t = 1.0)]
    pub(crate) scale: f64,
    /// Render a reference no longer than this
    #[arg(long, value_name = "TIME", value_parser = duration, default_value = "20s")]
    pub(crate) reference_time: Duration,
    /// The folder for reports and pictures, one folder in it for each experiment
    #[arg(short, long, value_name = "DIR")]
    pub(crate) output: Option<PathBuf>,
    /// Keep references here (default: steradian/references in the user's cache folder)
    #[arg(long, value_name = "DIR")]
    pub(crate) cache: Option<PathBuf>,
    /// Use this many threads (default: all)
    #[arg(long, value_name = "N", value_parser = threads, allow_negative_numbers = true)]
    pub(crate) threads: Option<NonZero<usize>>,
    /// Say nothing but warnings and errors
    #[arg(long)]
    pub(crate) quiet: bool,
    /// Print all figures as one JSON object at the end
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
pub(crate) struct AdviseArgs {
    #[command(flatten)]
    pub(crate) scene: SceneArgs,
    /// The error √relMSE that is wanted, such as 5%
    #[arg(long, value_name = "E", value_parser = precision, default_value = "5%")]
    pub(crate) error: Precision,
    /// The methods that may be recommended, as in `compare` (default: those that show all light)
    #[arg(long, value_name = "A,B,C", value_delimiter = ',', value_parser = entry)]
    pub(crate) integrators: Vec<Entry>,
    /// Let each pilot render for this long; each method has three
    #[arg(long, value_name = "TIME", value_parser = duration, default_value = "1s")]
    pub(crate) pilot: Duration,
    /// Recommend biased methods too, by their noise alone
    #[arg(long)]
    pub(crate) allow_biased: bool,
    /// Say nothing but warnings and errors
    #[arg(long)]
    pub(crate) quiet: bool,
    /// Print one JSON object at the end
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
pub(crate) struct BenchArgs {
    /// The scene to measure with (default: one that is built in)
    pub(crate) scene: Option<PathBuf>,
    /// Use this many threads (default: all)
    #[arg(long, value_name = "N", value_parser = threads, allow_negative_numbers = true)]
    pub(crate) threads: Option<NonZero<usize>>,
    /// Measure each figure for this long
    #[arg(long, value_name = "TIME", value_parser = duration, default_value = "2s")]
    pub(crate) time: Duration,
    /// Measure rays only, not the integrators' paths
    #[arg(long)]
    pub(crate) rays: bool,
    /// Print one JSON object
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
pub(crate) struct ReplayArgs {
    #[command(flatten)]
    pub(crate) scene: SceneArgs,
    #[command(flatten)]
    pub(crate) method: MethodArgs,
    /// The pixel that the path begins in
    #[arg(long, value_name = "X,Y", value_parser = pixel, allow_hyphen_values = true)]
    pub(crate) pixel: [i32; 2],
    /// The pass
    #[arg(long, value_name = "N")]
    pub(crate) pass: u32,
    /// Print one JSON object
    #[arg(long)]
    pub(crate) json: bool,
}

fn numbers<T: std::str::FromStr, const N: usize>(s: &str, separator: char) -> Option<[T; N]> {
    let parts: Vec<T> = s.split(separator).map(|p| p.trim().parse().ok()).collect::<Option<_>>()?;
    parts.try_into().ok()
}

fn resolution(s: &str) -> Result<[u32; 2], String> {
    numbers(s, 'x')
        .filter(|r: &[u32; 2]| r.iter().all(|&n| n > 0))
        .ok_or("expected WxH, such as 640x360".into())
}

fn crop(s: &str) -> Result<[i32; 4], String> {
    let crop: [i32; 4] = numbers(s, ',').ok_or("expected X0,Y0,X1,Y1 in pixels, such as 100,50,200,150")?;
    let [x0, y0, x1, y1] = crop;
    if x0 < x1 && y0 < y1 { Ok(crop) } else { Err("X0 must be below X1, and Y0 below Y1".into()) }
}

fn pixel(s: &str) -> Result<[i32; 2], String> {
    numbers(s, ',').ok_or("expected X,Y, such as 120,45".into())
}

fn precision(s: &str) -> Result<Precision, String> {
    s.parse()
}

fn entry(s: &str) -> Result<Entry, String> {
    Entry::parse(s)
}

fn threads(s: &str) -> Result<NonZero<usize>, String> {
    s.parse().map_err(|_| "expected a whole number from 1".into())
}

fn stops(s: &str) -> Result<f32, String> {
    s.parse().ok().filter(|x: &f32| x.is_finite()).ok_or("expected a number, such as 1.5 or -2".into())
}

fn isa(s: &str) -> Result<accel::Isa, String> {
    let isa = accel::Isa::from_name(s).ok_or("expected scalar, avx2 or avx512")?;
    if isa.is_available() { Ok(isa) } else { Err("this processor does not have it".into()) }
}

pub(crate) fn key_value(s: &str) -> Result<(String, String), String> {
    match s.split_once('=') {
        Some((k, v)) if !k.is_empty() => Ok((k.to_owned(), v.to_owned())),
        Some(_) | None => Err("expected NAME=VALUE".into()),
    }
}

fn threshold(s: &str) -> Result<(Metric, f64), String> {
    let (metric, value) = key_value(s)?;
    let value = value.parse().ok().filter(|v: &f64| !v.is_nan());
    Ok((metric.parse()?, value.ok_or("expected METRIC=VALUE, such as relmse=0.01")?))
}

fn passes(s: &str) -> Result<Range<u32>, String> {
    let range = s.split_once("..").and_then(|(a, b)| Some(a.parse().ok()?..b.parse().ok()?));
    range.filter(|r: &Range<u32>| !r.is_empty()).ok_or("expected A..B with A below B, such as 0..64".into())
}

/// `30s`, `2m`, `1.5h`, `200ms`; a bare number is in seconds.
fn duration(s: &str) -> Result<Duration, String> {
    let (number, unit) = s.split_at(s.find(|c: char| c.is_ascii_alphabetic()).unwrap_or(s.len()));
    let seconds = match unit {
        "ms" => Some(1e-3),
        "s" | "" => Some(1.0),
        "m" | "min" => Some(60.0),
        "h" => Some(3600.0),
        _ => None,
    };
    let value = number.trim().parse::<f64>().ok().zip(seconds).map(|(n, unit)| n * unit);
    value
        .filter(|t| *t > 0.0)
        .and_then(|t| Duration::try_from_secs_f64(t).ok())
        .ok_or("expected a time, such as 30s, 2m or 1.5h".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_line_is_well_formed() {
        use clap::CommandFactory;
        Cli::command().debug_assert();
    }

    #[test]
    fn times_have_units() {
        let read = |s| duration(s).map(|d| d.as_millis());
        assert_eq!(read("30s"), Ok(30_000));
        assert_eq!(read("2m"), Ok(120_000));
        assert_eq!(read("1.5h"), Ok(5_400_000));
        assert_eq!(read("250ms"), Ok(250));
        assert_eq!(read("7"), Ok(7000));
        for bad in ["", "s", "0s", "-1s", "1d", "nan", "inf", "1e300h"] {
            assert!(duration(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn numbers_are_checked() {
        assert!(threads("0").is_err() && threads("-1").is_err() && threads("x").is_err());
        assert_eq!(threads("2").map(NonZero::get), Ok(2));
        assert!(stops("nan").is_err() && stops("inf").is_err());
        assert_eq!(stops("-1.5"), Ok(-1.5));
    }

    #[test]
    fn ranges_and_sizes() {
        assert_eq!(passes("3..8"), Ok(3..8));
        assert!(passes("8..3").is_err() && passes("3..3").is_err() && passes("3").is_err());
        assert_eq!(resolution("640x360"), Ok([640, 360]));
        assert!(resolution("0x5").is_err() && resolution("640").is_err() && resolution("1x2x3").is_err());
        assert_eq!(crop("1,2,3,4"), Ok([1, 2, 3, 4]));
        assert!(crop("3,2,1,4").is_err() && crop("1,2,3").is_err());
        assert_eq!(key_value("a=b=c"), Ok(("a".into(), "b=c".into())));
        assert!(key_value("=b").is_err() && key_value("ab").is_err());
        assert_eq!(threshold("relMSE=0.5"), Ok((Metric::RelMse, 0.5)));
        assert!(threshold("relmse=x").is_err() && threshold("psnr=1").is_err());
    }
}
