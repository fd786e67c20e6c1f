//! Laws, statistics and analytic scenes for tests.
