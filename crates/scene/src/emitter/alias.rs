//! Choice in proportion to weights, in constant time.

/// Vose's alias table over `weights` that sum to `total` (Walker 1977, Vose 1991): per entry the
/// probability to keep it, and the entry to take otherwise.
pub(crate) fn alias_table(weights: &[f64], total: f64) -> Vec<(f32, u32)> {
    let n = weights.len();
    let mut scaled: Vec<f64> = weights.iter().map(|w| w * n as f64 / total).collect();
    let (mut small, mut large): (Vec<usize>, Vec<usize>) = (0..n).partition(|&i| scaled[i] < 1.0);
    let mut table: Vec<(f32, u32)> = (0..n).map(|i| (1.0, i as u32)).collect();
    while let (Some(s), Some(l)) = (small.pop(), large.pop()) {
        table[s] = (scaled[s] as f32, l as u32);
        scaled[l] = (scaled[l] + scaled[s]) - 1.0;
        if scaled[l] < 1.0 {
            small.push(l)
        } else {
            large.push(l)
        }
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn alias_table_gives_each_weight_its_share() {
        let weights = [1.0, 5.0, 0.25, 3.0, 0.75, 10.0, 1e-3];
        let total: f64 = weights.iter().sum();
        let table = alias_table(&weights, total);
        let n = weights.len() as f64;
        let mut share = vec![0.0; weights.len()];
        for (i, &(keep, other)) in table.iter().enumerate() {
            share[i] += f64::from(keep) / n;
            share[other as usize] += (1.0 - f64::from(keep)) / n;
        }
        for (s, w) in share.iter().zip(weights) {
            assert!((s - w / total).abs() < 1e-6, "share {s}, weight {w}");
        }
    }
}
