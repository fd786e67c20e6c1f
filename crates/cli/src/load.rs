//! From the arguments to a compiled scene, with everything that there is to say about it.

use math::Bounds2i;
use render::{Method, Opened, SceneOptions, Workers};
use scene_desc::{Severity, Sink};

use crate::args::{MethodArgs, SceneArgs};
use crate::exit::Failure;
use crate::messages;

/// Threads, as asked for.
pub(crate) fn workers(args: &SceneArgs) -> Result<Workers, Failure> {
    Ok(Workers::new(args.threads)?)
}

/// Loads and compiles; says what there is to say.
pub(crate) fn open(
    args: &SceneArgs,
    settings: &[(String, String)],
    workers: &Workers,
) -> Result<Opened, Failure> {
    let (opened, sink) = open_quietly(args, settings, workers)?;
    messages::diagnostics(&sink, false);
    Ok(opened)
}

/// The same; warnings are left to the caller.
pub(crate) fn open_quietly(
    args: &SceneArgs,
    settings: &[(String, String)],
    workers: &Workers,
) -> Result<(Opened, Sink), Failure> {
    let mut sink = Sink::default();
    if let Some(opened) = render::open(&args.scene, &options(args, settings), workers, &mut sink) {
        return Ok((opened, sink));
    }
    messages::diagnostics(&sink, args.strict);
    let errors = sink.diagnostics().iter().filter(|d| args.strict || d.severity == Severity::Error).count();
    let plural = if errors == 1 { "" } else { "s" };
    messages::note(&format!("{}: {errors} error{plural}", args.scene.display()));
    Err(Failure::InputSaid)
}

/// The method that the arguments ask for.
pub(crate) fn method(args: &MethodArgs) -> Method {
    Method { integrator: args.integrator.clone(), settings: args.set.clone(), seed: args.seed }
}

fn options(args: &SceneArgs, settings: &[(String, String)]) -> SceneOptions {
    SceneOptions {
        resolution: args.resolution,
        crop: args.crop.map(|[x0, y0, x1, y1]| Bounds2i::new([x0, y0], [x1, y1])),
        spectral: args.spectral,
        isa: args.isa,
        strict: args.strict,
        defines: args.define.clone(),
        settings: settings.to_vec(),
    }
}
