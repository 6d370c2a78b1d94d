//! A quantity that is stored and leaks: a current in a winding, a voltage on a capacitor.

/// How `storage dx/dt = push - leak x` goes on in a span of time while the push stays the same. Exact, so that it is
/// stable for any span.
#[derive(Clone, Copy, Debug)]
pub(super) struct Decay {
    /// Part of the value that is left at the end.
    pub(super) keep: f64,
    /// Value at the end per push.
    pub(super) gain: f64,
    /// Part of the value at the beginning that counts in the mean.
    pub(super) mean_keep: f64,
    /// Mean per push.
    pub(super) mean_gain: f64,
}

impl Decay {
    /// Leak 0 or more, storage and span more than 0.
    pub(super) fn new(leak: f64, storage: f64, seconds: f64) -> Self {
        let storage = storage.max(1e-12);
        let part = leak * seconds / storage;
        if part < 1e-6 {
            // The first terms of the series; what follows is beyond the precision of a float.
            return Self {
                keep: 1.0 - part * (1.0 - part / 2.0),
                gain: seconds / storage * (1.0 - part / 2.0),
                mean_keep: 1.0 - part / 2.0,
                mean_gain: seconds / storage * (0.5 - part / 6.0),
            };
        }
        let lost = -libm::expm1(-part);
        let mean_keep = lost / part;
        Self { keep: 1.0 - lost, gain: lost / leak, mean_keep, mean_gain: (1.0 - mean_keep) / leak }
    }

    /// Value at the end.
    pub(super) fn end(&self, value: f64, push: f64) -> f64 {
        self.keep * value + self.gain * push
    }

    /// Mean over the span.
    pub(super) fn mean(&self, value: f64, push: f64) -> f64 {
        self.mean_keep * value + self.mean_gain * push
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_decay_and_its_mean_are_those_of_the_exponential_function() {
        let decay = Decay::new(2.0, 4.0, 3.0);
        let left = (-1.5f64).exp();
        assert!((decay.end(5.0, 1.0) - (0.5 + 4.5 * left)).abs() < 1e-12);
        assert!((decay.mean(5.0, 1.0) - (0.5 + 4.5 * (1.0 - left) / 1.5)).abs() < 1e-12);
    }

    #[test]
    fn small_leaks_join_smoothly() {
        let (below, above) = (Decay::new(0.999e-6, 1.0, 1.0), Decay::new(1.001e-6, 1.0, 1.0));
        for (a, b) in [
            (below.keep, above.keep),
            (below.gain, above.gain),
            (below.mean_keep, above.mean_keep),
            (below.mean_gain, above.mean_gain),
        ] {
            assert!((a - b).abs() < 3e-9, "{a} {b}");
        }
        assert_eq!(Decay::new(0.0, 2.0, 1.0).end(1.0, 1.0), 1.5);
    }
}
