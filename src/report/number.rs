//! Numbers as the paper and the reports print them.

/// Six significant digits, trailing zeros cut off, powers of ten outside [1e-4, 1e6).
#[must_use]
pub fn six_digits(number: f64) -> String {
    let magnitude = number.abs();
    if number == 0.0 || (1e-4..1e6).contains(&magnitude) {
        // Five digits after the first significant one.
        let decimals = if number == 0.0 { 0 } else { 5 - magnitude.log10().floor() as i32 };
        let fixed = format!("{number:.*}", decimals.max(0) as usize);
        return trim_zeros(&fixed).to_owned();
    }
    let scientific = format!("{number:.5e}");
    match scientific.split_once('e') {
        Some((mantissa, exponent)) => format!("{}e{exponent}", trim_zeros(mantissa)),
        None => scientific,
    }
}

/// A value as `text` prints it, or a dash where there is none.
pub fn or_dash<T>(value: Option<T>, text: impl FnOnce(T) -> String) -> String {
    value.map_or("–".to_owned(), text)
}

/// Four digits after the point.
#[must_use]
pub fn four_decimals(number: f64) -> String {
    format!("{number:.4}")
}

fn trim_zeros(decimal: &str) -> &str {
    if decimal.contains('.') {
        decimal.trim_end_matches('0').trim_end_matches('.')
    } else {
        decimal
    }
}

#[cfg(test)]
mod tests {
    use super::six_digits;

    #[test]
    fn numbers_print_as_in_the_paper() {
        let printed = [
            (0.0478786, "0.0478786"),
            (46.384_12, "46.3841"),
            (1.127_17e-7, "1.12717e-7"),
            (1.8e66, "1.8e66"),
            (0.0, "0"),
            (-0.066_109_1, "-0.0661091"),
            (354.275, "354.275"),
        ];
        for (number, text) in printed {
            assert_eq!(six_digits(number), text);
        }
    }
}
