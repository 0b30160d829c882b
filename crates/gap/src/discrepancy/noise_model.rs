//! The noise model: a first-order autoregression, AR(1).

/// AR(1) noise of one channel; the standard deviation is relative to the noise that whitens the channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Noise {
    pub(crate) sd: f64,
    /// Correlation of neighbouring rows.
    pub(crate) correlation: f64,
}

impl Noise {
    /// White noise as declared.
    pub(crate) const WHITE: Self = Self {
        sd: 1.0,
        correlation: 0.0,
    };

    /// From a variance and an integrated autocorrelation time [rows].
    pub(crate) fn new(variance: f64, time: f64) -> Self {
        Self {
            sd: variance.sqrt(),
            correlation: (time - 1.0) / (time + 1.0),
        }
    }
}
