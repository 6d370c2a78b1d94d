//! Random numbers that are the same everywhere.

/// Number `index` of the sequence that SplitMix64 (Steele, Lea and Flood, 2014) gives for `seed`.
///
/// The generator only counts and mixes, so that each of its numbers can be had without those before
/// it. That is why it is here: a decision about one frame needs none about the frames before.
pub(super) fn random(seed: u64, index: u64) -> u64 {
    const GAMMA: u64 = 0x9E37_79B9_7F4A_7C15;
    let mut mixed = seed.wrapping_add(GAMMA.wrapping_mul(index.wrapping_add(1)));
    mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    mixed ^ (mixed >> 31)
}

/// A random number as one of 0.0..1.0, in steps of 2⁻⁵³: below 1, so that a rate of 1 always holds.
pub(super) fn unit(random: u64) -> f64 {
    const STEP: f64 = 1.0 / (1_u64 << 53) as f64;
    (random >> 11) as f64 * STEP
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sequence_is_that_of_the_published_generator() {
        // The test vector that implementations in many languages share, for the seed 1234567.
        let published = [
            6_457_827_717_110_365_317,
            3_203_168_211_198_807_973,
            9_817_491_932_198_370_423,
            4_593_380_528_125_082_431,
            16_408_922_859_458_223_821,
        ];
        assert_eq!(std::array::from_fn(|at| random(1_234_567, at as u64)), published);
    }

    #[test]
    fn the_unit_interval_does_not_contain_one() {
        assert_eq!(unit(0), 0.0);
        assert!(unit(u64::MAX) < 1.0);
    }
}
