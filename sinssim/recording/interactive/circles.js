// Circles about zero that have a share of a normal distribution, as sinssim/statistics/circular_error.py; the pages of
// budgets and of trade studies use them.
"use strict";
(() => {
  const POINTS = 128, QUARTER = Array.from({length: POINTS + 1}, (_, k) => {
    const cos = Math.cos(k * Math.PI / 2 / POINTS) ** 2;
    return {cos, sin: 1 - cos, weight: (k && k < POINTS ? 1 : 0.5) / POINTS};
  });

  // The share of a normal distribution without a mean in a circle, and its slope.
  function central(radius, large, small) {
    let inside = 0, slope = 0;
    for (const {cos, sin, weight} of QUARTER) {
      const s = large * cos + small * sin, outside = s > 0 ? Math.exp(-radius * radius / (2 * s)) : 0;
      inside += weight * (1 - outside);
      if (s > 0) slope += weight * outside * radius / s;
    }
    return [inside, slope];
  }

  const NODES = legendre(96);

  function legendre(count) {
    return Array.from({length: count}, (_, k) => {
      let x = Math.cos(Math.PI * (k + 0.75) / (count + 0.5)), slope = 1;
      for (let pass = 0; pass < 8; pass++) {
        let [before, now] = [1, x];
        for (let n = 2; n <= count; n++) [before, now] = [now, ((2 * n - 1) * x * now - (n - 1) * before) / n];
        slope = count * (x * now - before) / (x * x - 1);
        x -= now / slope;
      }
      return {x, weight: 2 / ((1 - x * x) * slope * slope)};
    });
  }

  // The normal distribution, by the series of the error function whose terms are all positive.
  function series(x) {
    let term = x, sum = x;
    for (let n = 3; Math.abs(term) > 1e-17 * Math.abs(sum); n += 2) sum += term *= x * x / n;
    return 0.5 + sum * density(x);
  }

  const density = x => Math.exp(-x * x / 2) / Math.sqrt(2 * Math.PI);
  const FINE = 256, REACH = 8.3; // points of the table for a standard deviation, and its ends
  const TABLE = Float64Array.from({length: 2 * Math.ceil(REACH * FINE) + 2}, (_, k) => series(k / FINE - REACH));
  const SLOPES = TABLE.map((_, k) => density(k / FINE - REACH) / FINE);

  // The same between the points of a table, by cubics, to 1e-12.
  function normal(x) {
    const at = (x + REACH) * FINE, k = Math.floor(at), t = at - k;
    if (!(k >= 0 && k + 1 < TABLE.length)) return x > 0 ? 1 : 0;
    const rise = TABLE[k + 1] - TABLE[k];
    return TABLE[k] + t * (rise + (1 - t) * ((1 - t) * (SLOPES[k] - rise) - t * (SLOPES[k + 1] - rise)));
  }

  // The share of a distribution with a mean, along its axes, in a circle; x = R sin t.
  function aside(radius, mean, sigma) {
    const end = way => Math.asin(Math.min(Math.max((mean[0] + way * 9 * sigma[0]) / radius, -1), 1));
    const low = end(-1), half = (end(1) - low) / 2;
    let sum = 0;
    for (const {x, weight} of NODES) {
      const t = low + half + half * x, up = radius * Math.cos(t), off = (radius * Math.sin(t) - mean[0]) / sigma[0];
      sum += weight * up * Math.exp(-off * off / 2) * (normal((up - mean[1]) / sigma[1]) - normal((-up - mean[1]) / sigma[1]));
    }
    return half * sum / (Math.sqrt(2 * Math.PI) * sigma[0]);
  }

  // Standard deviations and mean of {nn, ne, ee, n, e} along the axes of the distribution, the larger first.
  function axes({nn, ne, ee, n, e}) {
    const middle = (nn + ee) / 2, half = Math.hypot((nn - ee) / 2, ne), large = middle + half;
    const small = Math.max(middle - half, 0), turn = Math.atan2(2 * ne, nn - ee) / 2;
    const [c, s] = [Math.cos(turn), Math.sin(turn)];
    return {large, small, mean: [c * n + s * e, c * e - s * n], off: Math.hypot(n, e),
            sigma: [Math.sqrt(large), Math.sqrt(Math.max(small, 1e-18 * large))]};
  }

  function inside(radius, at) {
    const {large, small, mean, off, sigma} = axes(at), spread = Math.sqrt(Math.max(at.nn + at.ee, 0));
    if (off === 0 && large > 0) return central(radius, large, small)[0];
    return spread <= 1e-9 * off || off === 0 ? Number(off <= radius) : aside(radius, mean, sigma);
  }

  // The radius of the circle with a share of the distribution.
  function radius(at, share) {
    const {large, small, mean, off, sigma} = axes(at);
    let r = 0;
    if (large > 0) {
      // a second axis needs a larger circle: between one axis alone and equal axes
      let low = 0, high = Math.sqrt(-2 * large * Math.log1p(-share));
      r = high;
      for (let pass = 0, last = Infinity; pass < 100 && last > 1e-9 * r; pass++) {
        const [now, slope] = central(r, large, small);
        if (now < share) low = r; else high = r;
        const next = r - (now - share) / slope;
        last = Math.abs(next - r);
        r = next >= low && next <= high ? next : (low + high) / 2;
      }
    }
    if (!off) return r;
    if (Math.sqrt(Math.max(at.nn + at.ee, 0)) <= 1e-9 * off) return off;
    return root(middle => aside(middle, mean, sigma) - share, off + r, -share);
  }

  // The root of a rising function between zero, where it is `first`, and `most`, by the Illinois method.
  function root(value, most, first, last = value(most)) {
    let [low, below, high, above, side] = [0, first, most, last, 0];
    for (let pass = 0; pass < 100; pass++) {
      const middle = (low * above - high * below) / (above - below), now = value(Math.max(middle, 1e-300));
      if (now < 0) {
        if (side < 0) above /= 2;
        [low, below, side] = [middle, now, -1];
      } else {
        if (side > 0) below /= 2;
        [high, above, side] = [middle, now, 1];
      }
      if (Math.abs(now) < 1e-12 || high - low < 1e-12 * high) break;
    }
    return Math.abs(below) < Math.abs(above) ? low : high;
  }

  live.circles = {radius, inside, root};
})();
