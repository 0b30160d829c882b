//! Greatest sizes of a model: a card or a flag may say any number, and nothing of that size may be made before it is checked.

/// Greatest width of a layer, a latent, an embedding.
pub(crate) const MOST_WIDTH: usize = 65_536;
/// Greatest window [samples].
pub(crate) const MOST_WINDOW: usize = 4096;
/// Most tokens of an attention: their scores are a square.
pub(crate) const MOST_TOKENS: usize = 128;
/// Most hidden layers.
pub(crate) const MOST_LAYERS: usize = 64;
/// Most weights of a model: 256 MiB, of which training holds several copies (gradients, moments, the best so far).
pub(crate) const MOST_WEIGHTS: usize = 1 << 26;

/// Reason why sizes are too large, if they are: a window, single widths by name, lists of hidden widths.
pub(super) fn fault(
    window: usize,
    widths: &[(&'static str, usize)],
    hidden: &[&[usize]],
) -> Option<String> {
    if window > MOST_WINDOW {
        return Some(format!(
            "window is {window} samples, expected {MOST_WINDOW} at most"
        ));
    }
    if let Some(layers) = hidden.iter().find(|layers| layers.len() > MOST_LAYERS) {
        return Some(format!(
            "hidden has {} layers, expected {MOST_LAYERS} at most",
            layers.len()
        ));
    }
    let layers = hidden.iter().flat_map(|layers| layers.iter());
    (widths.iter().copied())
        .chain(layers.map(|width| ("hidden", *width)))
        .find(|(_, width)| *width > MOST_WIDTH)
        .map(|(name, width)| format!("{name} is {width}, expected {MOST_WIDTH} at most"))
}
