//! What a file says of its integrator is understood: no name and no parameter of pbrt-v4 stops a render.

use render::{Job, Method, SceneOptions};
use steradian_tests::{Eye, compile};

#[test]
fn every_parameter_of_every_integrator_of_pbrt_is_taken() {
    for integrator in [
        "\"path\" \"integer maxdepth\" 7 \"bool regularize\" true \"string lightsampler\" \"power\"",
        "\"volpath\" \"integer maxdepth\" 7 \"string lightsampler\" \"bvh\" \"bool regularize\" true",
        "\"simplepath\" \"integer maxdepth\" 3 \"bool samplelights\" false \"bool samplebsdf\" false",
        "\"simplevolpath\" \"integer maxdepth\" 3",
        "\"randomwalk\" \"integer maxdepth\" 3",
        "\"lightpath\" \"integer maxdepth\" 3",
        "\"bdpt\" \"integer maxdepth\" 3 \"bool visualizestrategies\" true \"bool visualizeweights\" true",
        "\"mlt\" \"integer maxdepth\" 3 \"integer bootstrapsamples\" 100 \"integer chains\" 10 \
         \"integer mutationsperpixel\" 9 \"float largestepprobability\" 0.5 \"float sigma\" 0.02",
        "\"sppm\" \"integer maxdepth\" 3 \"integer photonsperiteration\" 100 \"float radius\" 0.1 \"integer seed\" 3",
        "\"ambientocclusion\" \"bool cossample\" false \"float maxdistance\" 2",
    ] {
        let text = format!(
            "Integrator {integrator}\n{}LightSource \"infinite\"\nShape \"sphere\"\n",
            Eye::on_floor(4).head()
        );
        let scene = compile(&text, &SceneOptions::default());
        if let Err(e) = Job::new(&scene, &Method::default()) {
            panic!("{integrator}: {e}");
        }
    }
}
