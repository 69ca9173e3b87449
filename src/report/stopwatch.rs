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

/// Every job's time, in the order given.
#[must_use]
pub fn measure(mut jobs: Vec<Job<'_>>, patience: Patience) -> Vec<Timing> {
    let mut rounds: Vec<Vec<f64>> = vec![Vec::with_capacity(patience.repeats); jobs.len()];
    for job in &mut jobs {
        (job.run)();
    }
    for _ in 0..patience.repeats {
        for (job, times) in jobs.iter_mut().zip(&mut rounds) {
            times.push(round(job, patience.round));
        }
    }
    rounds.into_iter().map(timing).collect()
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

fn timing(mut times: Vec<f64>) -> Timing {
    times.sort_by(f64::total_cmp);
    let quantile = |share: f64| {
        let index = (share * (times.len().saturating_sub(1)) as f64).round() as usize;
        times.get(index).copied().unwrap_or(f64::NAN)
    };
    Timing {
        median_ns: quantile(0.5),
        spread_ns: 0.5 * (quantile(0.75) - quantile(0.25)),
        repeats: times.len(),
    }
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
    fn every_job_is_run_in_every_round() {
        let calls = std::cell::Cell::new(0);
        let job = || Job { run: Box::new(|| calls.set(calls.get() + 1)), evaluations: 10 };
        let patience = Patience { repeats: 3, round: Duration::ZERO };
        let timings = measure(vec![job(), job()], patience);
        assert_eq!(timings.len(), 2);
        assert_eq!(calls.get(), 2 * (1 + 3));
    }
}
