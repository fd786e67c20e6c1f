//! Tests of hypotheses: for a mean, a difference of means, a variance and a distribution.
//!
//! | function                                   | source                                    |
//! |--------------------------------------------|-------------------------------------------|
//! | `chi2_survival`: incomplete gamma function | [DLMF], sec. 8.11 (series), 8.9 (fraction) |
//! | `student_two_sided`: incomplete beta       | [DLMF], sec. 8.17                         |
//! | `t_test`, `welch_test`                     | [Welch1947]                               |
//! | `variance_test`                            | variance of s² from the fourth moment     |
//! | `ks_test`                                  | [Marsaglia2003], the asymptotic series    |
//! | `sidak`                                    | [Sidak1967]                               |
//!
//! Every test returns the probability of a result at least as extreme under the hypothesis. A test with fixed
//! seeds states the significance it uses: `1e-6` for one test, [`sidak`] for a family.
//! Left out: the exact distribution of the Kolmogorov–Smirnov statistic for few samples (n < 35).

/// What a test found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TestResult {
    /// The test statistic (z, t, χ² or D √n).
    pub statistic: f64,
    /// Chance of a statistic at least as extreme if the hypothesis holds.
    pub p_value: f64,
}

impl TestResult {
    /// Is the hypothesis kept at significance `alpha`? A NaN is never kept.
    #[must_use]
    pub fn is_consistent(&self, alpha: f64) -> bool {
        self.p_value >= alpha
    }

    /// Panics with both figures unless the hypothesis is kept at significance `alpha`.
    #[track_caller]
    pub fn assert_consistent(&self, alpha: f64, what: &str) {
        assert!(
            self.is_consistent(alpha),
            "{what}: statistic {:.4}, p = {:.3e} < {alpha:.1e}",
            self.statistic,
            self.p_value
        );
    }
}

/// Significance of each of `m` tests so that one in the family fails by chance with probability `alpha`:
/// `1 − (1 − α)^{1/m}` [Sidak1967].
#[must_use]
pub fn sidak(alpha: f64, m: usize) -> f64 {
    -libm::expm1(libm::log1p(-alpha) / m.max(1) as f64)
}

/// Central moments up to the fourth of a stream of numbers, in one pass [Pebay2008].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Moments {
    n: u64,
    mean: f64,
    m2: f64,
    m3: f64,
    m4: f64,
}

impl Moments {
    /// Of everything that `values` yields.
    #[must_use]
    pub fn of(values: impl IntoIterator<Item = f64>) -> Self {
        let mut m = Self::default();
        values.into_iter().for_each(|x| m.push(x));
        m
    }

    /// Takes one more number.
    pub fn push(&mut self, x: f64) {
        let n0 = self.n as f64;
        self.n += 1;
        let n = self.n as f64;
        let delta = x - self.mean;
        let d = delta / n;
        let d2 = d * d;
        let term = delta * d * n0;
        self.mean += d;
        self.m4 += term * d2 * (n * n - 3.0 * n + 3.0) + 6.0 * d2 * self.m2 - 4.0 * d * self.m3;
        self.m3 += term * d * (n - 2.0) - 3.0 * d * self.m2;
        self.m2 += term;
    }

    /// How many numbers there were.
    #[must_use]
    pub fn n(&self) -> u64 {
        self.n
    }

    /// Their mean.
    #[must_use]
    pub fn mean(&self) -> f64 {
        self.mean
    }

    /// The unbiased variance of one number; zero for fewer than two.
    #[must_use]
    pub fn variance(&self) -> f64 {
        if self.n < 2 { 0.0 } else { self.m2 / (self.n - 1) as f64 }
    }

    /// Standard error of the mean.
    #[must_use]
    pub fn std_error(&self) -> f64 {
        (self.variance() / self.n as f64).sqrt()
    }

    /// The mean with its standard error.
    #[must_use]
    pub fn estimate(&self) -> MeanEstimate {
        let degrees_of_freedom = (self.n.max(2) - 1) as f64;
        MeanEstimate { mean: self.mean, std_error: self.std_error(), degrees_of_freedom }
    }

    /// The interval that holds the mean with probability `confidence`, if it is nearly normal. Infinite below two numbers.
    #[must_use]
    pub fn mean_interval(&self, confidence: f64) -> [f64; 2] {
        if self.n < 2 {
            return [f64::NEG_INFINITY, f64::INFINITY];
        }
        let half = student_two_sided_quantile(1.0 - confidence, (self.n - 1) as f64) * self.std_error();
        [self.mean - half, self.mean + half]
    }

    /// The fourth central moment.
    #[must_use]
    pub fn fourth_moment(&self) -> f64 {
        self.m4 / self.n as f64
    }
}

/// Is the mean `mu`, when one number is nearly normal or there are very many?
///
/// With zero variance the mean must equal `mu` to within rounding (1e-12 relative).
#[must_use]
pub fn t_test(m: &Moments, mu: f64) -> TestResult {
    from_difference(m.mean() - mu, m.std_error(), (m.n.max(2) - 1) as f64, mu.abs())
}

/// Have both the same mean, whatever their variances [Welch1947]?
#[must_use]
pub fn welch_test(a: &Moments, b: &Moments) -> TestResult {
    a.estimate().compare(&b.estimate())
}

/// A mean with what is known of its error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeanEstimate {
    /// The mean.
    pub mean: f64,
    /// Its standard error.
    pub std_error: f64,
    /// Of the standard error; infinite if that is known.
    pub degrees_of_freedom: f64,
}

impl MeanEstimate {
    /// From batch means `x` of batches of size `w`, each `(x, w)`: the variance of a batch mean is in proportion to 1/w.
    /// Below two batches the standard error is infinite.
    #[must_use]
    pub fn of_batches(batches: impl Iterator<Item = (f64, f64)> + Clone) -> Self {
        let total: f64 = batches.clone().map(|(_, w)| w).sum();
        let mean = batches.clone().map(|(x, w)| x * w).sum::<f64>() / total;
        let squares: f64 = batches.clone().map(|(x, w)| w * (x - mean) * (x - mean)).sum();
        let degrees_of_freedom = batches.count() as f64 - 1.0;
        let std_error = match degrees_of_freedom > 0.0 {
            true => (squares / degrees_of_freedom / total).sqrt(),
            false => f64::INFINITY,
        };
        Self { mean, std_error, degrees_of_freedom: degrees_of_freedom.max(1.0) }
    }

    /// Have both the same mean [Welch1947]?
    #[must_use]
    pub fn compare(&self, other: &Self) -> TestResult {
        let (va, vb) = (self.std_error.powi(2), other.std_error.powi(2));
        let (na, nb) = (self.degrees_of_freedom, other.degrees_of_freedom);
        let df = match va + vb > 0.0 {
            true => (va + vb).powi(2) / (va * va / na + vb * vb / nb),
            false => na + nb,
        };
        if (va + vb).is_infinite() {
            return TestResult { statistic: 0.0, p_value: 1.0 };
        }
        let scale = self.mean.abs().max(other.mean.abs());
        from_difference(self.mean - other.mean, (va + vb).sqrt(), df, scale)
    }
}

/// Is the mean `mu`, with a standard error that is known or comes from very many numbers?
#[must_use]
pub fn z_test(mean: f64, mu: f64, std_error: f64) -> TestResult {
    from_difference(mean - mu, std_error, f64::INFINITY, mu.abs())
}

/// Is the variance of one number `variance`? The spread of s² comes from the fourth moment found.
#[must_use]
pub fn variance_test(m: &Moments, variance: f64) -> TestResult {
    let n = m.n as f64;
    let of_s2 = (m.fourth_moment() - variance * variance * (n - 3.0) / (n - 1.0)) / n;
    from_difference(m.variance() - variance, of_s2.max(0.0).sqrt(), f64::INFINITY, variance)
}

fn from_difference(difference: f64, std_error: f64, df: f64, scale: f64) -> TestResult {
    if std_error == 0.0 {
        let equal = difference.abs() <= 1e-12 * scale.max(f64::MIN_POSITIVE);
        let (statistic, p_value) = if equal { (0.0, 1.0) } else { (f64::INFINITY, 0.0) };
        return TestResult { statistic, p_value };
    }
    let t = difference / std_error;
    TestResult { statistic: t, p_value: student_two_sided(t, df) }
}

/// Do the samples follow the continuous distribution function `cdf`? Sorts them.
#[must_use]
pub fn ks_test(samples: &mut [f64], cdf: impl Fn(f64) -> f64) -> TestResult {
    samples.sort_by(f64::total_cmp);
    let n = samples.len() as f64;
    let d = samples.iter().enumerate().fold(0.0_f64, |d, (i, &x)| {
        let f = cdf(x);
        d.max((f - i as f64 / n).abs()).max(((i + 1) as f64 / n - f).abs())
    });
    // Q(λ) = 2 Σ (−1)^{k−1} e^{−2k²λ²}; the small shift of λ is the correction for finite n [Stephens1970].
    let root = n.sqrt();
    let lambda = d * (root + 0.12 + 0.11 / root);
    let tail = |k: i32| libm::exp(-2.0 * f64::from(k * k) * lambda * lambda);
    let q: f64 = (1..=100).map(|k| if k % 2 == 1 { tail(k) } else { -tail(k) }).sum();
    let p_value = if lambda < 0.2 { 1.0 } else { (2.0 * q).clamp(0.0, 1.0) };
    TestResult { statistic: d * root, p_value }
}

/// Least-squares slope of log y over log x: the order of convergence of an error.
#[must_use]
pub fn log_log_slope(points: &[(f64, f64)]) -> f64 {
    log_log_fit(points).slope
}

/// A straight line through points on double logarithmic paper.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LogLogFit {
    /// The exponent of x.
    pub slope: f64,
    /// Its standard error from the residuals; infinite for fewer than three points.
    pub slope_std_error: f64,
    /// log y where log x = 0.
    pub intercept: f64,
    /// Points less the two that a line takes.
    pub degrees_of_freedom: f64,
}

impl LogLogFit {
    /// The interval that holds the slope with probability `confidence`, if errors of log y are normal and alike.
    #[must_use]
    pub fn slope_interval(&self, confidence: f64) -> [f64; 2] {
        let half =
            student_two_sided_quantile(1.0 - confidence, self.degrees_of_freedom) * self.slope_std_error;
        [self.slope - half, self.slope + half]
    }
}

/// Least squares of log y over log x.
#[must_use]
pub fn log_log_fit(points: &[(f64, f64)]) -> LogLogFit {
    let logs: Vec<_> = points.iter().map(|&(x, y)| (libm::log(x), libm::log(y))).collect();
    let n = logs.len() as f64;
    let mx = logs.iter().map(|p| p.0).sum::<f64>() / n;
    let my = logs.iter().map(|p| p.1).sum::<f64>() / n;
    let cov: f64 = logs.iter().map(|p| (p.0 - mx) * (p.1 - my)).sum();
    let spread = logs.iter().map(|p| (p.0 - mx).powi(2)).sum::<f64>();
    let slope = cov / spread;
    let intercept = my - slope * mx;
    let residual = logs.iter().map(|p| (p.1 - intercept - slope * p.0).powi(2)).sum::<f64>();
    let degrees_of_freedom = n - 2.0;
    let slope_std_error = match degrees_of_freedom > 0.0 {
        true => (residual / degrees_of_freedom / spread).sqrt(),
        false => f64::INFINITY,
    };
    LogLogFit { slope, slope_std_error, intercept, degrees_of_freedom }
}

/// P(|Z| > |z|) for a standard normal Z.
#[must_use]
pub fn normal_two_sided(z: f64) -> f64 {
    libm::erfc(z.abs() / std::f64::consts::SQRT_2)
}

/// P(Z ≤ z) for a standard normal Z.
#[must_use]
pub fn normal_cdf(z: f64) -> f64 {
    0.5 * libm::erfc(-z / std::f64::consts::SQRT_2)
}

/// The |z| that a standard normal exceeds with probability `p` (both sides together), by bisection.
#[must_use]
pub fn normal_two_sided_quantile(p: f64) -> f64 {
    let (mut lo, mut hi) = (0.0, 40.0);
    for _ in 0..100 {
        let mid = 0.5 * (lo + hi);
        if normal_two_sided(mid) > p { lo = mid } else { hi = mid }
    }
    0.5 * (lo + hi)
}

/// P(|T| > |t|) for Student's T with `df` degrees of freedom (infinity: the normal distribution).
#[must_use]
pub fn student_two_sided(t: f64, df: f64) -> f64 {
    if t.is_nan() || df.is_nan() {
        return f64::NAN;
    }
    if df > 1e7 { normal_two_sided(t) } else { incomplete_beta(0.5 * df, 0.5, df / (df + t * t)) }
}

/// The |t| that Student's T with `df` degrees of freedom exceeds with probability `p` (both sides together), by bisection.
/// Infinite for less than one degree of freedom.
#[must_use]
pub fn student_two_sided_quantile(p: f64, df: f64) -> f64 {
    if df.is_nan() || df < 1.0 {
        return f64::INFINITY;
    }
    let (mut lo, mut hi) = (0.0, 1e9);
    for _ in 0..200 {
        let mid = if hi > 2.0 * lo + 1.0 { (lo + 1.0) * 1.5 } else { 0.5 * (lo + hi) };
        if student_two_sided(mid, df) > p { lo = mid } else { hi = mid }
    }
    0.5 * (lo + hi)
}

/// P(X > x) for X of the chi-squared distribution with `df` degrees of freedom.
#[must_use]
pub fn chi2_survival(x: f64, df: f64) -> f64 {
    if x <= 0.0 {
        return 1.0;
    }
    let (a, x) = (0.5 * df, 0.5 * x);
    let front = libm::exp(a * libm::log(x) - x - libm::lgamma(a));
    if x < a + 1.0 {
        // 1 − P(a, x), with P by its power series.
        let (mut term, mut sum, mut n) = (1.0 / a, 1.0 / a, a);
        while term > sum * 1e-16 {
            n += 1.0;
            term *= x / n;
            sum += term;
        }
        (1.0 - front * sum).clamp(0.0, 1.0)
    } else {
        // Q(a, x) = front / (x + 1 − a − 1(1 − a) / (x + 3 − a − …)).
        let fraction = lentz(x + 1.0 - a, |i| (-i * (i - a), x + 2.0 * i + 1.0 - a));
        (front / fraction).clamp(0.0, 1.0)
    }
}

/// Regularised incomplete beta function `I_x(a, b)`.
fn incomplete_beta(a: f64, b: f64, x: f64) -> f64 {
    if x <= 0.0 || x >= 1.0 {
        return x.clamp(0.0, 1.0);
    }
    // The fraction converges fast on this side of the mean only.
    if x > (a + 1.0) / (a + b + 2.0) {
        return 1.0 - incomplete_beta(b, a, 1.0 - x);
    }
    let ln_front =
        libm::lgamma(a + b) - libm::lgamma(a) - libm::lgamma(b) + a * libm::log(x) + b * libm::log1p(-x);
    let fraction = lentz(1.0, |i| {
        let m = (i * 0.5).floor();
        let numerator = if i % 2.0 == 0.0 {
            m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m))
        } else {
            -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0))
        };
        (numerator, 1.0)
    });
    libm::exp(ln_front) / (a * fraction)
}

/// The continued fraction `b0 + a1/(b1 + a2/(b2 + …))` by the modified Lentz method [Thompson1986].
fn lentz(b0: f64, term: impl Fn(f64) -> (f64, f64)) -> f64 {
    let guard = |x: f64| if x.abs() < 1e-300 { 1e-300 } else { x };
    let (mut f, mut c, mut d) = (guard(b0), guard(b0), 0.0);
    for i in 1..100_000 {
        let (a, b) = term(f64::from(i));
        d = 1.0 / guard(b + a * d);
        c = guard(b + a / c);
        let delta = c * d;
        f *= delta;
        if (delta - 1.0).abs() < 1e-15 {
            break;
        }
    }
    f
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn critical_values_of_chi_squared_are_those_of_the_tables() {
        // Ground truth, sec. 12: critical values at 1e-6; and the median of two degrees of freedom, 2 ln 2.
        for (df, x) in [(50.0, 112.6), (199.0, 308.6), (1000.0, 1227.2), (5000.0, 5489.8)] {
            let p = chi2_survival(x, df);
            assert!((p / 1e-6 - 1.0).abs() < 0.03, "{df}: {p:e}");
        }
        assert!((chi2_survival(2.0 * std::f64::consts::LN_2, 2.0) - 0.5).abs() < 1e-14);
        assert!((chi2_survival(3.841_458_820_694_124, 1.0) - 0.05).abs() < 1e-12);
    }

    #[test]
    fn students_distribution_is_that_of_the_tables() {
        // Two-sided 5 %: t(1) = 12.7062, t(10) = 2.228139, t(30) = 2.042272.
        for (df, t) in [(1.0, 12.706_204_74), (10.0, 2.228_138_85), (30.0, 2.042_272_46)] {
            assert!((student_two_sided(t, df) - 0.05).abs() < 1e-9, "{df}");
        }
        // A family of a thousand at 1e-3: z 4.892, t31 6.07, t63 5.42 (ground truth, sec. 12).
        let each = sidak(1e-3, 1000);
        assert!((normal_two_sided_quantile(each) - 4.892).abs() < 1e-3);
        assert!((student_two_sided(6.07, 31.0) / each - 1.0).abs() < 0.03);
        assert!((student_two_sided(5.42, 63.0) / each - 1.0).abs() < 0.03);
    }

    #[test]
    fn moments_are_those_of_two_passes() {
        let xs: Vec<f64> = (0..1000).map(|i| libm::sin(f64::from(i * i)) + 3.0).collect();
        let m = Moments::of(xs.iter().copied());
        let mean = xs.iter().sum::<f64>() / 1000.0;
        let central = |k: i32| xs.iter().map(|x| (x - mean).powi(k)).sum::<f64>();
        assert!((m.mean() - mean).abs() < 1e-12);
        assert!((m.variance() - central(2) / 999.0).abs() < 1e-12);
        assert!((m.fourth_moment() - central(4) / 1000.0).abs() < 1e-12);
    }

    #[test]
    fn kolmogorov_smirnov_knows_its_critical_values_and_a_wrong_distribution() {
        // The grid of midpoints is as uniform as can be; its square is not.
        let mut xs: Vec<f64> = (0..1000).map(|i| (f64::from(i) + 0.5) / 1000.0).collect();
        assert!(ks_test(&mut xs, |x| x).p_value > 0.999);
        let mut squares: Vec<f64> = xs.iter().map(|x| x * x).collect();
        assert!(ks_test(&mut squares, |x| x).p_value < 1e-12);
        assert!(ks_test(&mut squares, |x| x.sqrt()).p_value > 0.999);
        // Shifted so that D √n is about 1.628: the 1 % point.
        let shift = 1.628 / 1e6_f64.sqrt();
        let mut shifted: Vec<f64> = (0..1_000_000).map(|i| (f64::from(i) + 0.5) / 1e6 + shift).collect();
        assert!((ks_test(&mut shifted, |x| x.min(1.0)).p_value - 0.01).abs() < 1e-3);
    }

    #[test]
    fn a_wrong_mean_and_a_wrong_variance_are_found() {
        let uniform = Moments::of((0..10_000_u64).map(|i| math::hash::mix64(i) as f64 / u64::MAX as f64));
        assert!(t_test(&uniform, 0.5).is_consistent(1e-6));
        assert!(!t_test(&uniform, 0.52).is_consistent(1e-6));
        assert!(variance_test(&uniform, 1.0 / 12.0).is_consistent(1e-6));
        assert!(!variance_test(&uniform, 1.0 / 11.0).is_consistent(1e-6));
        let other = Moments::of((0..5_000_u64).map(|i| math::hash::mix64(!i) as f64 / u64::MAX as f64));
        assert!(welch_test(&uniform, &other).is_consistent(1e-6));
        let constant = Moments::of([2.0; 5]);
        assert!(t_test(&constant, 2.0).is_consistent(1e-6) && !t_test(&constant, 2.1).is_consistent(1e-6));
    }

    #[test]
    fn quantiles_undo_distributions() {
        for (df, t) in [(1.0, 12.706_204_74), (10.0, 2.228_138_85), (30.0, 2.042_272_46)] {
            assert!((student_two_sided_quantile(0.05, df) / t - 1.0).abs() < 1e-8, "{df}");
        }
        assert!((student_two_sided_quantile(0.05, f64::INFINITY) - 1.959_963_985).abs() < 1e-8);
        assert_eq!(student_two_sided_quantile(0.05, 0.0), f64::INFINITY);
        let [lo, hi] = Moments::of([1.0, 2.0, 3.0]).mean_interval(0.95);
        // t(2) = 4.302653, standard error 1/√3.
        assert!((hi - 2.0 - 4.302_653 / 3.0_f64.sqrt()).abs() < 1e-5 && (lo + hi - 4.0).abs() < 1e-12);
    }

    #[test]
    fn a_fit_knows_how_sure_it_is() {
        let exact: Vec<_> = (0..6).map(|i| (2.0_f64.powi(i), 3.0 * 2.0_f64.powi(-i))).collect();
        let fit = log_log_fit(&exact);
        assert!((fit.slope + 1.0).abs() < 1e-12 && (libm::exp(fit.intercept) - 3.0).abs() < 1e-9);
        assert!(fit.slope_std_error < 1e-9);
        // log y is 0, 1, 0 at log x = 0, 1, 2: slope 0, residual 2/3, spread 2.
        let e = std::f64::consts::E;
        let bent = log_log_fit(&[(1.0, 1.0), (e, e), (e * e, 1.0)]);
        assert!(bent.slope.abs() < 1e-12 && (bent.slope_std_error - (1.0 / 3.0_f64).sqrt()).abs() < 1e-12);
        assert_eq!(log_log_fit(&exact[..2]).slope_std_error, f64::INFINITY);
    }

    #[test]
    fn batches_of_one_size_are_a_sample() {
        let xs = [1.0, 4.0, 2.0, 7.0];
        let batches = MeanEstimate::of_batches(xs.iter().map(|&x| (x, 5.0)));
        let moments = Moments::of(xs).estimate();
        assert!((batches.mean - moments.mean).abs() < 1e-12);
        assert!((batches.std_error - moments.std_error).abs() < 1e-12);
        assert_eq!(batches.degrees_of_freedom, moments.degrees_of_freedom);
        let one = MeanEstimate::of_batches([(1.0, 1.0)].into_iter());
        assert_eq!(one.compare(&moments).p_value, 1.0, "one batch says nothing");
    }

    /// Sums of w numbers with deviation 1 are batches whose means have the deviation 1/√w.
    #[test]
    fn batches_of_any_size_give_the_error_of_the_whole() {
        let uniform = |i: u64| math::hash::mix64(i) as f64 / u64::MAX as f64;
        let mut next = 0;
        let batches: Vec<(f64, f64)> = (0..4000)
            .map(|b| {
                let size = 1 << (b % 7);
                let sum: f64 = (next..next + size).map(uniform).sum();
                next += size;
                (sum / size as f64, size as f64)
            })
            .collect();
        let estimate = MeanEstimate::of_batches(batches.into_iter());
        let expected = (1.0 / 12.0 / next as f64).sqrt();
        assert!((estimate.std_error / expected - 1.0).abs() < 0.05);
        assert!((estimate.mean - 0.5).abs() < 5.0 * expected);
    }
}
