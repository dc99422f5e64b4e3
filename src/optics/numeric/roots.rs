//! One root in a bracket.

/// No bracketed solve takes more evaluations than this.
///
/// Bisection alone brings any bracket of ordinary numbers down to neighbouring
/// floats in under 120 halvings; Newton steps that shrink the bracket too
/// little are replaced by bisection, so twice that is a safe bound.
pub const MAX_ITERATIONS: u32 = 240;

/// A root and how it was found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Root {
    /// Where the function is zero, to the rounding of the function itself.
    pub value: f64,
    /// What the function gives there.
    pub residual: f64,
    /// Evaluations of the function, at most [`MAX_ITERATIONS`].
    pub iterations: u32,
}

/// Why there is no [`Root`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum RootError {
    /// The bracket's ends are not finite or not in order.
    BadBracket {
        /// Lower end as given.
        low: f64,
        /// Upper end as given.
        high: f64,
    },
    /// The function has the same sign at both ends.
    NoSignChange {
        /// Value at the lower end.
        at_low: f64,
        /// Value at the upper end.
        at_high: f64,
    },
    /// The function or its slope was not finite at this argument.
    NotFinite {
        /// The argument.
        at: f64,
    },
    /// The bound on iterations was reached.
    IterationLimit {
        /// The width of the bracket that was left.
        width: f64,
    },
}

impl std::fmt::Display for RootError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::BadBracket { low, high } => write!(f, "[{low}, {high}] is not a bracket"),
            Self::NoSignChange { at_low, at_high } => {
                write!(f, "no change of sign: {at_low} and {at_high} at the ends")
            }
            Self::NotFinite { at } => write!(f, "the function is not finite at {at}"),
            Self::IterationLimit { width } => {
                write!(f, "no root after {MAX_ITERATIONS} iterations, the bracket is still {width} wide")
            }
        }
    }
}

impl std::error::Error for RootError {}

/// Newton's method kept inside a bracket: a step that leaves the bracket, or
/// shrinks the function too little, becomes a bisection.
///
/// `f` returns the function and its derivative. The function must change sign
/// over `[low, high]` (a zero at an end counts). `start` is clamped into the
/// bracket. The solve ends at an exact zero, when a Newton step is below two
/// ulp of the argument, or when the bracket's ends are neighbours; it needs no
/// tolerance from the caller.
///
/// # Errors
/// [`RootError`]; never a value that is not a root.
pub fn bracketed_newton(
    mut f: impl FnMut(f64) -> (f64, f64),
    low: f64,
    high: f64,
    start: f64,
) -> Result<Root, RootError> {
    if !(low.is_finite() && high.is_finite() && low <= high) {
        return Err(RootError::BadBracket { low, high });
    }
    let (at_low, _) = f(low);
    let (at_high, _) = f(high);
    for (at, value) in [(low, at_low), (high, at_high)] {
        if !value.is_finite() {
            return Err(RootError::NotFinite { at });
        }
        if value == 0.0 {
            return Ok(Root { value: at, residual: 0.0, iterations: 2 });
        }
    }
    if (at_low > 0.0) == (at_high > 0.0) {
        return Err(RootError::NoSignChange { at_low, at_high });
    }
    let rising = at_high > 0.0;
    let (mut a, mut b) = (low, high);
    let mut x = if start > a && start < b { start } else { midpoint(a, b) };
    let mut last = f64::INFINITY;
    for iterations in 3..=MAX_ITERATIONS {
        let (value, slope) = f(x);
        if !value.is_finite() {
            return Err(RootError::NotFinite { at: x });
        }
        if value == 0.0 {
            return Ok(Root { value: x, residual: 0.0, iterations });
        }
        if (value > 0.0) == rising {
            b = x;
        } else {
            a = x;
        }
        let newton = x - value / slope;
        let step_is_rounding = (newton - x).abs() <= 2.0 * f64::EPSILON * x.abs();
        let neighbours = midpoint(a, b) <= a || midpoint(a, b) >= b;
        if step_is_rounding || neighbours {
            return Ok(Root { value: x, residual: value, iterations });
        }
        let useful = newton > a && newton < b && value.abs() < 0.5 * last;
        last = value.abs();
        x = if useful { newton } else { midpoint(a, b) };
    }
    Err(RootError::IterationLimit { width: b - a })
}

fn midpoint(a: f64, b: f64) -> f64 {
    // Halving each end first cannot overflow.
    0.5 * a + 0.5 * b
}
