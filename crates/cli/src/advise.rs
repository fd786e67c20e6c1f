//! `steradian advise`.

use lab::advise::{Advice, PILOTS, Question, advise};

use crate::args::AdviseArgs;
use crate::compare::{self, Teller};
use crate::exit::{Done, Status};
use crate::interrupt::Interrupt;
use crate::{load, messages};

pub(crate) fn run(args: &AdviseArgs) -> Done {
    let interrupt = Interrupt::install()?;
    let workers = load::workers(&args.scene)?;
    let opened = load::open(&args.scene, &[], &workers)?;
    let entries = match args.integrators.is_empty() {
        true => lab::advise::candidates(&opened.scene),
        false => args.integrators.clone(),
    };
    let question = Question {
        entries,
        target: args.error.target,
        pilot: args.pilot,
        pilots: PILOTS,
        allow_biased: args.allow_biased,
    };
    let teller = Teller::new(!args.quiet);
    interrupt.rendering();
    let mut on_pilot = |label: &str| teller.say(&format!("pilot: {label}"));
    let advice = advise(&question, &opened.scene, &workers, &interrupt.cancel, &mut on_pilot);
    teller.end();
    let advice = advice.map_err(compare::failure)?;
    if args.json {
        messages::json(&advice);
    } else {
        print(&advice, args.error.target);
    }
    Ok(Status::Done)
}

fn print(advice: &[Advice], target: f64) {
    messages::say(&format!("seconds of rendering to an error of {} %:", 100.0 * target));
    for a in advice {
        let s = &a.seconds;
        let note = match (&a.objection, a.recommended, a.unbiased) {
            (Some(objection), _, _) => objection.as_str(),
            (None, true, _) => "recommended",
            (None, false, false) => "of its noise alone: it is biased",
            (None, false, true) => "",
        };
        let interval = format!("{:.3} … {:.3}", s.low, s.high);
        messages::say(&format!("{:<20}{:>10.3}  ({interval})  {:>8.0} spp  {note}", a.label, s.value, a.spp));
    }
    if !advice.iter().any(|a| a.recommended) {
        messages::say("none can be recommended: let pilots run longer (--pilot), or allow biased methods");
    }
}
