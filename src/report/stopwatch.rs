//! Times of several jobs measured in turns, so that a disturbance of the machine meets all alike.

use std::time::{Duration, Instant};

use serde::Serialize;

/// The time of one job.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Timing {
    /// Median of the rounds \[ns per evaluation\].
    pub median_ns: f64,
    /// Half the distance between the quartiles \[ns\].
    pub spread_ns: f64,
    /// Rounds measured.
    pub repeats: usize,
}

/// A job runs `evaluations` evaluations at each call.
pub struct Job<'a> {
    /// One round.
    pub run: Box<dyn FnMut() + 'a>,
    /// Evaluations in a round.
    pub evaluations: usize,
}

/// How long to measure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Patience {
    /// Rounds of every job.
    pub repeats: usize,
    /// A round repeats its job until so much time has passed.
    pub round: Duration,
}

/// Times of every job in the same rounds \[ns per evaluation\].
#[derive(Clone, Debug, PartialEq)]
pub struct Rounds(Vec<Vec<f64>>);

/// Measures every job once in every round, in the order given.
#[must_use]
pub fn measure(mut jobs: Vec<Job<'_>>, patience: Patience) -> Rounds {
    let mut rounds: Vec<Vec<f64>> = vec![Vec::with_capacity(patience.repeats); jobs.len()];
    // A call ahead of the rounds, for caches and pages that are touched first.
    for job in &mut jobs {
        (job.run)();
    }
    for _ in 0..patience.repeats {
        for (job, times) in jobs.iter_mut().zip(&mut rounds) {
            times.push(round(job, patience.round));
        }
    }
    Rounds::new(rounds)
}

/// Nanoseconds per evaluation of one round.
fn round(job: &mut Job<'_>, at_least: Duration) -> f64 {
    let start = Instant::now();
    let mut calls = 0;
    loop {
        (job.run)();
        calls += 1;
        let elapsed = start.elapsed();
        if elapsed >= at_least {
            return elapsed.as_secs_f64() * 1e9 / (calls * job.evaluations) as f64;
        }
    }
}

impl Rounds {
    /// Per job, the times of its rounds.
    #[must_use]
    pub fn new(times: Vec<Vec<f64>>) -> Self {
        Self(times)
    }

    /// Time and spread of every job.
    #[must_use]
    pub fn timings(&self) -> Vec<Timing> {
        self.0.iter().map(|times| timing(times.clone())).collect()
    }

    /// How long job `a` takes as a multiple of job `b`: the median over rounds of t_a/t_b, in which
    /// the pace of the machine cancels.
    #[must_use]
    pub fn ratio(&self, a: usize, b: usize) -> f64 {
        let ratios = self.0[a].iter().zip(&self.0[b]).map(|(a, b)| a / b);
        quantile(&sorted(ratios.collect()), 0.5)
    }
}

fn timing(times: Vec<f64>) -> Timing {
    let times = sorted(times);
    Timing {
        median_ns: quantile(&times, 0.5),
        spread_ns: 0.5 * (quantile(&times, 0.75) - quantile(&times, 0.25)),
        repeats: times.len(),
    }
}

fn sorted(mut values: Vec<f64>) -> Vec<f64> {
    values.sort_by(f64::total_cmp);
    values
}

/// The value below which a `share` of the sorted ones lie.
fn quantile(sorted: &[f64], share: f64) -> f64 {
    // The nearest rank: a time that was measured, not a mean of two.
    let index = (share * sorted.len().saturating_sub(1) as f64).round() as usize;
    sorted.get(index).copied().unwrap_or(f64::NAN)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_ignores_one_slow_round() {
        let timing = timing(vec![2.0, 900.0, 1.0, 3.0, 2.0]);
        assert_eq!((timing.median_ns, timing.spread_ns, timing.repeats), (2.0, 0.5, 5));
    }

    #[test]
    fn a_ratio_compares_within_rounds() {
        // The machine slows down in the last round, and the second job loses the first one.
        let rounds = Rounds::new(vec![vec![1.0, 1.0, 5.0], vec![80.0, 2.0, 10.0]]);
        assert_eq!(rounds.ratio(1, 0), 2.0, "the medians' ratio would be 10");
    }

    #[test]
    fn every_round_runs_every_job_in_turn() {
        let calls = std::cell::RefCell::new(Vec::new());
        let jobs = ['a', 'b'].map(|name| {
            let calls = &calls;
            Job { run: Box::new(move || calls.borrow_mut().push(name)), evaluations: 10 }
        });
        let patience = Patience { repeats: 3, round: Duration::ZERO };
        let rounds = measure(jobs.into(), patience);
        assert_eq!(rounds.timings().iter().map(|t| t.repeats).collect::<Vec<_>>(), [3, 3]);
        assert_eq!(calls.borrow().iter().collect::<String>(), "ab".repeat(1 + 3));
    }
}
