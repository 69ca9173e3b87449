//! The Pareto front of time and error, with a tolerance that makes a second measurement agree.

use crate::report::stopwatch::Rounds;

/// An error so many times smaller outweighs a time as many times longer: half a decade. What another
/// program on the same core does to the ratio of two methods' times is a fraction of that.
pub const DECISIVE: f64 = 3.0;
/// Errors that differ by no more than this factor are alike: then the time decides, by this factor.
pub const ALIKE: f64 = 1.25;
/// A time longer by at most this factor counts as equal.
pub const NO_SLOWER: f64 = 1.1;

/// The rule in words, for the report's readers.
pub const RULE: &str = "A method is off the front where another one has the smaller error and takes \
    at most a tenth more time; or has less than a third of its error and takes at most three times \
    as long; or is faster by a quarter with an error at most a quarter larger. Times are compared \
    within each round, by the median of their ratio. The margin is that ratio over the limit that is \
    nearest to deciding: above 1, on the front";

/// Per job the ratio of time over the limit that comes nearest to pushing it off the front: it is
/// on the front above 1.
///
/// # Formula
///
/// margin(b) = min over a of (t_a/t_b) / limit(e_a/e_b), where t_a/t_b is the median over rounds, in
/// which the pace of the machine cancels; infinite where no a has a limit.
///
/// Errors carry no noise, so only a margin within the scatter of its ratio around 1 can fall
/// differently in another run. A method without error is on the front, unless another such is
/// faster.
#[must_use]
pub fn margins(rounds: &Rounds, errors: &[f64]) -> Vec<f64> {
    (0..errors.len()).map(|job| margin(rounds, errors, job)).collect()
}

/// The margin of one job.
fn margin(rounds: &Rounds, errors: &[f64], job: usize) -> f64 {
    let others = (0..errors.len()).filter(|other| *other != job);
    let ratios = others.filter_map(|a| Some(rounds.ratio(a, job) / limit(errors[a], errors[job])?));
    ratios.fold(f64::INFINITY, f64::min)
}

/// The longest time, as a multiple of another method's, at which a method of error `own` pushes one
/// of error `other` off the front; `None` where no time is short enough.
fn limit(own: f64, other: f64) -> Option<f64> {
    if DECISIVE * own < other {
        Some(DECISIVE)
    } else if own < other {
        Some(NO_SLOWER)
    } else {
        // Not nearer, so it has to be faster, and alike in error.
        (own <= ALIKE * other).then_some(1.0 / ALIKE)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use rand::{RngExt, SeedableRng as _};
    use rand_pcg::Pcg64Mcg;

    use super::*;

    /// Which of (time, error) are on the front.
    fn front(methods: &[[f64; 2]]) -> Vec<bool> {
        let [times, errors] = [0, 1].map(|i| methods.iter().map(|m| m[i]).collect::<Vec<f64>>());
        let rounds = Rounds::new(times.into_iter().map(|t| vec![t]).collect());
        margins(&rounds, &errors).into_iter().map(|margin| margin > 1.0).collect()
    }

    #[test]
    fn small_differences_do_not_decide() {
        assert_eq!(front(&[[1.0, 1.0], [2.0, 2.0]]), [true, false], "nearer and faster");
        assert_eq!(front(&[[1.0, 1.2], [1.3, 1.0]]), [true, false], "faster, errors alike");
        assert_eq!(front(&[[2.9, 1e-6], [1.0, 1e-2]]), [true, false], "nearer, and worth its time");
        assert_eq!(front(&[[1.0, 1.0], [1.2, 1.0]]), [true, true], "alike");
        assert_eq!(front(&[[1.0, 2.0], [2.0, 1.0]]), [true, true], "each has its gain");
        assert_eq!(front(&[[3.1, 1e-6], [1.0, 1e-2]]), [true, true], "each has its gain");
        assert_eq!(front(&[[9.0, 0.0], [12.0, 0.0], [1.0, 1.0]]), [true, false, true], "exact");
    }

    #[test]
    fn a_margin_is_the_ratio_over_the_limit() {
        let rounds = Rounds::new(vec![vec![100.0], vec![40.0], vec![4.0], vec![5.0]]);
        let margins = margins(&rounds, &[0.0, 1e-6, 1e-3, 1.1e-3]);
        let expected = [f64::INFINITY, 2.5 / 3.0, 1.25 * 1.25, 4.0 / 5.0 / NO_SLOWER];
        for (margin, expected) in margins.iter().zip(expected) {
            assert!(*margin == expected || (margin / expected - 1.0).abs() < 1e-12, "{margins:?}");
        }
    }

    /// Times on a machine whose pace wanders by half, whose jobs scatter by 5 % and lose one round
    /// in thirty to another program.
    fn noisy(times: &[f64], repeats: usize, seed: u64) -> Rounds {
        let mut rng = Pcg64Mcg::seed_from_u64(seed);
        let mut rounds = vec![Vec::new(); times.len()];
        for _ in 0..repeats {
            let pace = 1.0 + 0.5 * rng.random::<f64>();
            for (job, time) in rounds.iter_mut().zip(times) {
                let lost = if rng.random::<f64>() < 1.0 / 30.0 { 40.0 } else { 1.0 };
                job.push(time * pace * lost * (0.95 + 0.1 * rng.random::<f64>()));
            }
        }
        Rounds::new(rounds)
    }

    #[test]
    fn noise_does_not_move_the_front() {
        // Like chrome's methods: near ties in time and in error among them.
        let methods = [
            [3400.0, 0.0],
            [2300.0, 1.5e-13],
            [1980.0, 7.5e-10],
            [1830.0, 1.4e-5],
            [1830.0, 5.8e-5],
            [24.0, 3.18e-4],
            [28.0, 3.3e-4],
            [40.0, 3.18e-4],
            [600.0, 3.18e-4],
            [85.0, 0.9],
        ];
        let [times, errors] = [0, 1].map(|i| methods.map(|m| m[i]));
        let on = [true, false, false, false, false, true, false, false, false, false];
        assert_eq!(front(&methods), on);
        for seed in 0..200 {
            let margins = margins(&noisy(&times, 51, seed), &errors);
            let found: Vec<bool> = margins.iter().map(|margin| *margin > 1.0).collect();
            assert_eq!(found, on, "seed {seed}: {margins:?}");
        }
    }

    proptest! {
        #[test]
        fn the_exact_method_is_on_the_front(
            mut methods in prop::collection::vec([1.0..3.0_f64, 1e-300..9.0_f64], 1..40)
        ) {
            methods.push([1e3, 0.0]);
            prop_assert!(front(&methods)[methods.len() - 1]);
        }
    }
}
