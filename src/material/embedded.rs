//! Lines of the tables that are compiled in: they are ours, and tests read all of them.

/// The numbers in a line of an embedded table from column `first` on.
pub(super) fn numbers<const N: usize>(columns: &[&str], first: usize) -> [f64; N] {
    std::array::from_fn(|i| {
        let number = columns[first + i].parse();
        number.expect("the embedded tables hold numbers; a test reads all of them")
    })
}
