//! Closed sets by value: an enum of kinds, with `From` for each kind and a match that leaves none out.

/// Defines an enum whose variants hold the kind of the same name, `From<Kind>` for each, the list of `NAMES`, and
/// a macro (named after `dispatch`) that runs one expression for whichever kind is there. Tidy checks that every
/// member has its laws.
macro_rules! closed_set {
    (
        ($d:tt)
        $(#[$meta:meta])*
        pub enum $set:ident dispatch $dispatch:ident {
            $($(#[$doc:meta])* $kind:ident),* $(,)?
        }
    ) => {
        $(#[$meta])*
        pub enum $set {
            $($(#[$doc])* $kind($kind)),*
        }

        impl $set {
            /// The names of all kinds.
            pub const NAMES: &[&str] = &[$(stringify!($kind)),*];

            /// The name of this kind.
            #[must_use]
            pub fn name(&self) -> &'static str {
                match self {
                    $(Self::$kind(_) => stringify!($kind)),*
                }
            }
        }

        $(impl From<$kind> for $set {
            fn from(kind: $kind) -> Self {
                Self::$kind(kind)
            }
        })*

        macro_rules! $dispatch {
            ($d value:expr, $d it:ident => $d body:expr) => {
                match $d value {
                    $($set::$kind($d it) => $d body),*
                }
            };
        }
    };
}
pub(crate) use closed_set;
