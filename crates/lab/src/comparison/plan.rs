//! What is compared, for how long, and against what.

use std::path::PathBuf;
use std::time::Duration;

use render::Method;

/// A method that takes part.
#[derive(Clone, Debug)]
pub struct Entry {
    /// How tables and plots call it.
    pub label: String,
    /// It and its settings; its seed is ignored.
    pub method: Method,
}

/// What each run may spend.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Budget {
    /// Time of rendering alone.
    Time(Duration),
    /// Passes.
    Samples(u32),
}

/// What is true.
#[derive(Clone, Debug)]
pub enum Truth {
    /// A picture, pixel by pixel as large as the render; an EXR file may have its variance as a layer.
    Picture {
        /// Where it came from, for the report.
        name: String,
        /// Linear R, G, B, row by row.
        rgb: Vec<[f32; 3]>,
        /// Variance of each value, if known.
        variance: Option<Vec<[f32; 3]>>,
    },
    /// A render that is made for this, and kept.
    Render {
        /// By which method.
        method: Method,
        /// Its estimated relMSE is to be below this.
        relmse: f64,
        /// But it shall not take longer.
        time: Duration,
        /// A folder that keeps it for the next time.
        cache: Option<PathBuf>,
    },
}

/// A comparison that may be run.
#[derive(Clone, Debug)]
pub struct Plan {
    /// Who takes part.
    pub entries: Vec<Entry>,
    /// What each run may spend.
    pub budget: Budget,
    /// Runs of each method, with these seeds.
    pub seeds: Vec<u64>,
    /// What is true.
    pub truth: Truth,
}

impl Entry {
    /// From `name:key=value:key=value`, as the command line has it.
    ///
    /// # Errors
    /// A setting without `=`, or no name.
    pub fn parse(text: &str) -> Result<Self, String> {
        let mut parts = text.split(':');
        let name = parts.next().map(str::trim).filter(|n| !n.is_empty());
        let name = name.ok_or_else(|| format!("`{text}` names no integrator"))?.to_owned();
        let setting = |part: &str| match part.split_once('=') {
            Some((k, v)) if !k.is_empty() => Ok((k.trim().to_owned(), v.trim().to_owned())),
            Some(_) | None => {
                Err(format!("`{part}` in `{text}` is no setting: expected NAME:KEY=VALUE:KEY=VALUE"))
            }
        };
        let settings = parts.map(setting).collect::<Result<_, _>>()?;
        let method = Method { integrator: Some(name), settings, seed: None };
        Ok(Self { label: text.trim().to_owned(), method })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_entry_has_a_name_and_settings() {
        let e = Entry::parse("path:mis=false:max_depth=3").unwrap();
        assert_eq!(e.method.integrator.as_deref(), Some("path"));
        assert_eq!(e.method.settings[1], ("max_depth".to_owned(), "3".to_owned()));
        assert!(Entry::parse("path:mis").is_err() && Entry::parse(":a=b").is_err());
    }
}
