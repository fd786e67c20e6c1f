//! `steradian convert`.

use std::path::PathBuf;

use clap::Args;
use scene_desc::Sink;

use crate::args::key_value;
use crate::exit::{Done, Failure, Status};
use crate::messages::{self, say};

#[derive(Debug, Args)]
pub(crate) struct ConvertArgs {
    /// The scene file (.pbrt, .pbrt.gz, .xml)
    pub(crate) scene: PathBuf,
    /// The pbrt-v4 file to write (.pbrt)
    pub(crate) output: PathBuf,
    /// Make every warning an error: what pbrt-v4 cannot say is then not written
    #[arg(long)]
    pub(crate) strict: bool,
    /// Give a $parameter of the scene file a value
    #[arg(short = 'D', value_name = "NAME=VALUE", value_parser = key_value)]
    pub(crate) define: Vec<(String, String)>,
}

pub(crate) fn run(args: &ConvertArgs) -> Done {
    if !args.output.extension().is_some_and(|e| e.eq_ignore_ascii_case("pbrt")) {
        return Err(Failure::input(format!("{}: expected a name that ends in .pbrt", args.output.display())));
    }
    let same = |a: &std::path::Path| a.canonicalize().ok();
    if same(&args.scene).is_some() && same(&args.scene) == same(&args.output) {
        return Err(Failure::input("the scene would be written over itself"));
    }
    let mut sink = Sink::default();
    let scene = formats::load_with(&args.scene, &args.define, &mut sink);
    let is_refused = args.strict && !sink.diagnostics().is_empty();
    let Some(scene) = scene.filter(|_| !is_refused) else {
        messages::diagnostics(&sink, args.strict);
        return Err(Failure::InputSaid);
    };
    let written = formats::write_pbrt(&scene, &args.output, args.strict, &mut sink);
    messages::diagnostics(&sink, args.strict);
    match written {
        Ok(()) => {
            say(&format!("wrote {}", args.output.display()));
            Ok(Status::Done)
        }
        Err(e @ formats::WriteError::Strict) => Err(Failure::input(e)),
        Err(e) => Err(Failure::failed(e)),
    }
}
