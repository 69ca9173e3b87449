//! The axes of charts: where values lie, and which of them are named.

/// How values become positions along an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// Evenly.
    Linear,
    /// By their logarithm; values must be positive.
    Log,
}

/// An axis from `low` to `high`.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// Label with its unit.
    pub label: String,
    /// How values are spaced.
    pub scale: Scale,
    /// The value at the left or bottom end.
    pub low: f64,
    /// The value at the right or top end.
    pub high: f64,
}

impl Axis {
    /// An evenly spaced axis.
    #[must_use]
    pub fn linear(label: &str, low: f64, high: f64) -> Self {
        Self { label: label.to_owned(), scale: Scale::Linear, low, high }
    }

    /// A logarithmic axis, its ends moved out to whole decades.
    #[must_use]
    pub fn decades(label: &str, low: f64, high: f64) -> Self {
        let (low, high) = (low.log10().floor(), high.log10().ceil());
        Self {
            label: label.to_owned(),
            scale: Scale::Log,
            low: 10_f64.powf(low),
            // At least one decade, also where all values are equal.
            high: 10_f64.powf(high.max(low + 1.0)),
        }
    }

    /// Position of a value, 0 at `low` and 1 at `high`.
    pub(super) fn position(&self, value: f64) -> f64 {
        match self.scale {
            Scale::Linear => (value - self.low) / (self.high - self.low),
            Scale::Log => (value / self.low).ln() / (self.high / self.low).ln(),
        }
    }

    /// Round values along the axis, at most about six.
    pub(super) fn ticks(&self) -> Vec<f64> {
        match self.scale {
            Scale::Linear => linear_ticks(self.low, self.high),
            Scale::Log => decade_ticks(self.low, self.high),
        }
    }
}

fn linear_ticks(low: f64, high: f64) -> Vec<f64> {
    let rough = (high - low) / 5.0;
    let magnitude = 10_f64.powf(rough.log10().floor());
    // The first round step that makes five intervals or fewer.
    let step = [1.0, 2.0, 3.0, 5.0, 10.0].map(|m| m * magnitude).into_iter().find(|s| *s >= rough);
    let step = step.unwrap_or(10.0 * magnitude);
    // An end that is a multiple of the step but for rounding gets a tick.
    let first = (low / step - 1e-9).ceil() as i64;
    let last = (high / step + 1e-9).floor() as i64;
    (first..=last).map(|i| i as f64 * step).collect()
}

fn decade_ticks(low: f64, high: f64) -> Vec<f64> {
    let (first, last) = (low.log10().round() as i32, high.log10().round() as i32);
    let step = ((last - first) / 7 + 1) as usize;
    // Multiples of the step, so that 1 is among them wherever the axis starts.
    let first = first + (-first).rem_euclid(step as i32);
    (first..=last).step_by(step).map(|decade| 10_f64.powi(decade)).collect()
}

/// A tick's label: plain where short, else a power of ten.
pub(super) fn tick_label(value: f64) -> String {
    let magnitude = value.abs();
    if value == 0.0 || (1e-3..1e4).contains(&magnitude) {
        let digits = format!("{value:.3}");
        return digits.trim_end_matches('0').trim_end_matches('.').to_owned();
    }
    // Only a whole decade has no mantissa to print.
    match format!("{value:e}").strip_prefix("1e") {
        Some(exponent) => format!("10{}", exponent.chars().map(superscript).collect::<String>()),
        None => format!("{value:e}"),
    }
}

fn superscript(letter: char) -> char {
    const DIGITS: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    letter.to_digit(10).map_or('⁻', |digit| DIGITS[digit as usize])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_few() {
        assert_eq!(linear_ticks(0.0, 90.0), [0.0, 20.0, 40.0, 60.0, 80.0]);
        assert_eq!(decade_ticks(1e-3, 1e1).len(), 5);
        assert!(decade_ticks(1e-30, 1e4).len() <= 8);
        assert_eq!(tick_label(0.05), "0.05");
        assert_eq!(tick_label(1e-12), "10⁻¹²");
        assert_eq!(decade_ticks(1e-14, 1.0), [1e-12, 1e-9, 1e-6, 1e-3, 1.0]);
    }
}
