// Small dense matrices: solving, products, eigenvalues and eigenvectors.

export type Matrix = number[][];

export interface Complex {
  re: number;
  im: number;
}

export function identity(n: number): Matrix {
  return Array.from({ length: n }, (_, i) => Array.from({ length: n }, (_, j) => (i === j ? 1 : 0)));
}

export function product(a: Matrix, b: Matrix): Matrix {
  return a.map((row) => b[0].map((_, j) => row.reduce((sum, value, k) => sum + value * b[k][j], 0)));
}

export function times(a: Matrix, x: number[]): number[] {
  return a.map((row) => row.reduce((sum, value, k) => sum + value * x[k], 0));
}

/** The rows and columns of a matrix that an index names. */
export function selected(a: Matrix, index: number[]): Matrix {
  return index.map((i) => index.map((j) => a[i][j]));
}

/** Solve a x = b by elimination with row pivoting; null where the matrix is singular. */
export function solve(a: Matrix, b: number[]): number[] | null {
  const n = b.length;
  const m = a.map((row, i) => [...row, b[i]]);
  for (let k = 0; k < n; k++) {
    let pivot = k;
    for (let i = k + 1; i < n; i++) if (Math.abs(m[i][k]) > Math.abs(m[pivot][k])) pivot = i;
    if (!(Math.abs(m[pivot][k]) > 0)) return null;
    [m[k], m[pivot]] = [m[pivot], m[k]];
    for (let i = k + 1; i < n; i++) {
      const factor = m[i][k] / m[k][k];
      for (let j = k; j <= n; j++) m[i][j] -= factor * m[k][j];
    }
  }
  const x = new Array<number>(n).fill(0);
  for (let i = n - 1; i >= 0; i--) {
    let sum = m[i][n];
    for (let j = i + 1; j < n; j++) sum -= m[i][j] * x[j];
    x[i] = sum / m[i][i];
  }
  return x;
}

/** Determinant, by elimination. */
export function determinant(a: Matrix): number {
  const m = a.map((row) => [...row]);
  const n = m.length;
  let value = 1;
  for (let k = 0; k < n; k++) {
    let pivot = k;
    for (let i = k + 1; i < n; i++) if (Math.abs(m[i][k]) > Math.abs(m[pivot][k])) pivot = i;
    if (pivot !== k) {
      [m[k], m[pivot]] = [m[pivot], m[k]];
      value = -value;
    }
    value *= m[k][k];
    if (value === 0) return 0;
    for (let i = k + 1; i < n; i++) {
      const factor = m[i][k] / m[k][k];
      for (let j = k; j < n; j++) m[i][j] -= factor * m[k][j];
    }
  }
  return value;
}

export function magnitude(z: Complex): number {
  return Math.hypot(z.re, z.im);
}

/** Matrix exponential by scaling, a Taylor series and squaring. */
export function exponential(a: Matrix): Matrix {
  const size = Math.max(...a.map((row) => row.reduce((sum, value) => sum + Math.abs(value), 0)));
  const halvings = Math.max(0, Math.ceil(Math.log2(Math.max(size, 1e-300))) + 3);
  const scaled = a.map((row) => row.map((value) => value / 2 ** halvings));
  let sum = identity(a.length);
  let term = identity(a.length);
  for (let k = 1; k <= 14; k++) {
    term = product(term, scaled).map((row) => row.map((value) => value / k));
    sum = sum.map((row, i) => row.map((value, j) => value + term[i][j]));
  }
  for (let k = 0; k < halvings; k++) sum = product(sum, sum);
  return sum;
}

export interface Eigen {
  values: Complex[];
  /** `vectors[k]` belongs to `values[k]`, of unit length. */
  vectors: Complex[][];
}

/**
 * Eigenvalues and right eigenvectors of a real matrix.
 *
 * Householder reduction to Hessenberg form, then the shifted QR algorithm (EISPACK's orthes and hqr2, as in JAMA, public domain).
 */
export function eigen(matrix: Matrix): Eigen {
  const n = matrix.length;
  const h = matrix.map((row) => [...row]);
  const v = identity(n);
  toHessenberg(h, v);
  const [re, im] = toSchur(h, v);
  const values = re.map((x, k) => ({ re: x, im: im[k] }));
  const vectors: Complex[][] = [];
  for (let k = 0; k < n; k++) {
    if (im[k] < 0 && k > 0 && im[k - 1] > 0) {
      vectors.push(vectors[k - 1].map((z) => ({ re: z.re, im: -z.im })));
    } else {
      const pair = im[k] > 0;
      vectors.push(unit(v.map((row) => ({ re: row[k], im: pair ? row[k + 1] : 0 }))));
    }
  }
  return { values, vectors };
}

function unit(vector: Complex[]): Complex[] {
  const length = Math.hypot(...vector.map(magnitude));
  return length > 0 ? vector.map((z) => ({ re: z.re / length, im: z.im / length })) : vector;
}

function toHessenberg(h: Matrix, v: Matrix): void {
  const n = h.length;
  const ort = new Array<number>(n).fill(0);
  for (let m = 1; m < n - 1; m++) {
    let scale = 0;
    for (let i = m; i < n; i++) scale += Math.abs(h[i][m - 1]);
    if (scale === 0) continue;
    let sum = 0;
    for (let i = n - 1; i >= m; i--) {
      ort[i] = h[i][m - 1] / scale;
      sum += ort[i] * ort[i];
    }
    const g = ort[m] > 0 ? -Math.sqrt(sum) : Math.sqrt(sum);
    sum -= ort[m] * g;
    ort[m] -= g;
    for (let j = m; j < n; j++) {
      let f = 0;
      for (let i = n - 1; i >= m; i--) f += ort[i] * h[i][j];
      f /= sum;
      for (let i = m; i < n; i++) h[i][j] -= f * ort[i];
    }
    for (let i = 0; i < n; i++) {
      let f = 0;
      for (let j = n - 1; j >= m; j--) f += ort[j] * h[i][j];
      f /= sum;
      for (let j = m; j < n; j++) h[i][j] -= f * ort[j];
    }
    ort[m] *= scale;
    h[m][m - 1] = scale * g;
  }
  for (let m = n - 2; m >= 1; m--) {
    if (h[m][m - 1] === 0) continue;
    for (let i = m + 1; i < n; i++) ort[i] = h[i][m - 1];
    for (let j = m; j < n; j++) {
      let g = 0;
      for (let i = m; i < n; i++) g += ort[i] * v[i][j];
      g = g / ort[m] / h[m][m - 1];
      for (let i = m; i < n; i++) v[i][j] += g * ort[i];
    }
  }
}

function divided(ar: number, ai: number, br: number, bi: number): [number, number] {
  if (Math.abs(br) > Math.abs(bi)) {
    const r = bi / br;
    const d = br + r * bi;
    return [(ar + r * ai) / d, (ai - r * ar) / d];
  }
  const r = br / bi;
  const d = bi + r * br;
  return [(r * ar + ai) / d, (r * ai - ar) / d];
}

/** Reduce a Hessenberg matrix to real Schur form and turn `v` into eigenvectors; returns both parts of the eigenvalues. */
function toSchur(h: Matrix, v: Matrix): [number[], number[]] {
  const nn = h.length;
  const eps = 2 ** -52;
  const re = new Array<number>(nn).fill(0);
  const im = new Array<number>(nn).fill(0);
  let n = nn - 1;
  let exshift = 0;
  let p = 0, q = 0, r = 0, s = 0, z = 0, w = 0, x = 0, y = 0;
  let norm = 0;
  for (let i = 0; i < nn; i++) for (let j = Math.max(i - 1, 0); j < nn; j++) norm += Math.abs(h[i][j]);
  if (norm === 0) return [re, im];
  let iter = 0;
  while (n >= 0) {
    let l = n;
    while (l > 0) {
      s = Math.abs(h[l - 1][l - 1]) + Math.abs(h[l][l]);
      if (s === 0) s = norm;
      if (Math.abs(h[l][l - 1]) < eps * s) break;
      l--;
    }
    if (l === n) {
      h[n][n] += exshift;
      re[n] = h[n][n];
      im[n] = 0;
      n--;
      iter = 0;
    } else if (l === n - 1) {
      w = h[n][n - 1] * h[n - 1][n];
      p = (h[n - 1][n - 1] - h[n][n]) / 2;
      q = p * p + w;
      z = Math.sqrt(Math.abs(q));
      h[n][n] += exshift;
      h[n - 1][n - 1] += exshift;
      x = h[n][n];
      if (q >= 0) {
        z = p >= 0 ? p + z : p - z;
        re[n - 1] = x + z;
        re[n] = z !== 0 ? x - w / z : re[n - 1];
        im[n - 1] = im[n] = 0;
        x = h[n][n - 1];
        s = Math.abs(x) + Math.abs(z);
        p = x / s;
        q = z / s;
        r = Math.sqrt(p * p + q * q);
        p /= r;
        q /= r;
        for (let j = n - 1; j < nn; j++) {
          z = h[n - 1][j];
          h[n - 1][j] = q * z + p * h[n][j];
          h[n][j] = q * h[n][j] - p * z;
        }
        for (let i = 0; i <= n; i++) {
          z = h[i][n - 1];
          h[i][n - 1] = q * z + p * h[i][n];
          h[i][n] = q * h[i][n] - p * z;
        }
        for (let i = 0; i < nn; i++) {
          z = v[i][n - 1];
          v[i][n - 1] = q * z + p * v[i][n];
          v[i][n] = q * v[i][n] - p * z;
        }
      } else {
        re[n - 1] = re[n] = x + p;
        im[n - 1] = z;
        im[n] = -z;
      }
      n -= 2;
      iter = 0;
    } else {
      x = h[n][n];
      y = h[n - 1][n - 1];
      w = h[n][n - 1] * h[n - 1][n];
      if (iter === 10) {
        exshift += x;
        for (let i = 0; i <= n; i++) h[i][i] -= x;
        s = Math.abs(h[n][n - 1]) + Math.abs(h[n - 1][n - 2]);
        x = y = 0.75 * s;
        w = -0.4375 * s * s;
      }
      if (iter === 30) {
        s = (y - x) / 2;
        s = s * s + w;
        if (s > 0) {
          s = y < x ? -Math.sqrt(s) : Math.sqrt(s);
          s = x - w / ((y - x) / 2 + s);
          for (let i = 0; i <= n; i++) h[i][i] -= s;
          exshift += s;
          x = y = w = 0.964;
        }
      }
      iter++;
      if (iter > 300) return [re.fill(NaN), im.fill(NaN)];
      let m = n - 2;
      while (m >= l) {
        z = h[m][m];
        r = x - z;
        s = y - z;
        p = (r * s - w) / h[m + 1][m] + h[m][m + 1];
        q = h[m + 1][m + 1] - z - r - s;
        r = h[m + 2][m + 1];
        s = Math.abs(p) + Math.abs(q) + Math.abs(r);
        p /= s;
        q /= s;
        r /= s;
        if (m === l) break;
        const small = Math.abs(h[m][m - 1]) * (Math.abs(q) + Math.abs(r));
        const large = Math.abs(p) * (Math.abs(h[m - 1][m - 1]) + Math.abs(z) + Math.abs(h[m + 1][m + 1]));
        if (small < eps * large) break;
        m--;
      }
      for (let i = m + 2; i <= n; i++) {
        h[i][i - 2] = 0;
        if (i > m + 2) h[i][i - 3] = 0;
      }
      for (let k = m; k <= n - 1; k++) {
        const notlast = k !== n - 1;
        if (k !== m) {
          p = h[k][k - 1];
          q = h[k + 1][k - 1];
          r = notlast ? h[k + 2][k - 1] : 0;
          x = Math.abs(p) + Math.abs(q) + Math.abs(r);
          if (x === 0) continue;
          p /= x;
          q /= x;
          r /= x;
        }
        s = Math.sqrt(p * p + q * q + r * r);
        if (p < 0) s = -s;
        if (s === 0) continue;
        if (k !== m) h[k][k - 1] = -s * x;
        else if (l !== m) h[k][k - 1] = -h[k][k - 1];
        p += s;
        x = p / s;
        y = q / s;
        z = r / s;
        q /= p;
        r /= p;
        for (let j = k; j < nn; j++) {
          p = h[k][j] + q * h[k + 1][j];
          if (notlast) {
            p += r * h[k + 2][j];
            h[k + 2][j] -= p * z;
          }
          h[k][j] -= p * x;
          h[k + 1][j] -= p * y;
        }
        for (let i = 0; i <= Math.min(n, k + 3); i++) {
          p = x * h[i][k] + y * h[i][k + 1];
          if (notlast) {
            p += z * h[i][k + 2];
            h[i][k + 2] -= p * r;
          }
          h[i][k] -= p;
          h[i][k + 1] -= p * q;
        }
        for (let i = 0; i < nn; i++) {
          p = x * v[i][k] + y * v[i][k + 1];
          if (notlast) {
            p += z * v[i][k + 2];
            v[i][k + 2] -= p * r;
          }
          v[i][k] -= p;
          v[i][k + 1] -= p * q;
        }
      }
    }
  }
  backSubstitute(h, v, re, im, norm, eps);
  return [re, im];
}

function backSubstitute(h: Matrix, v: Matrix, re: number[], im: number[], norm: number, eps: number): void {
  const nn = h.length;
  let r = 0, s = 0, z = 0;
  for (let n = nn - 1; n >= 0; n--) {
    const p = re[n];
    let q = im[n];
    if (q === 0) {
      let l = n;
      h[n][n] = 1;
      for (let i = n - 1; i >= 0; i--) {
        const w = h[i][i] - p;
        r = 0;
        for (let j = l; j <= n; j++) r += h[i][j] * h[j][n];
        if (im[i] < 0) {
          z = w;
          s = r;
          continue;
        }
        l = i;
        if (im[i] === 0) {
          h[i][n] = w !== 0 ? -r / w : -r / (eps * norm);
        } else {
          const x = h[i][i + 1];
          const y = h[i + 1][i];
          q = (re[i] - p) * (re[i] - p) + im[i] * im[i];
          const t = (x * s - z * r) / q;
          h[i][n] = t;
          h[i + 1][n] = Math.abs(x) > Math.abs(z) ? (-r - w * t) / x : (-s - y * t) / z;
        }
        const t = Math.abs(h[i][n]);
        if (eps * t * t > 1) for (let j = i; j <= n; j++) h[j][n] /= t;
      }
    } else if (q < 0) {
      let l = n - 1;
      if (Math.abs(h[n][n - 1]) > Math.abs(h[n - 1][n])) {
        h[n - 1][n - 1] = q / h[n][n - 1];
        h[n - 1][n] = -(h[n][n] - p) / h[n][n - 1];
      } else {
        [h[n - 1][n - 1], h[n - 1][n]] = divided(0, -h[n - 1][n], h[n - 1][n - 1] - p, q);
      }
      h[n][n - 1] = 0;
      h[n][n] = 1;
      for (let i = n - 2; i >= 0; i--) {
        let ra = 0, sa = 0;
        for (let j = l; j <= n; j++) {
          ra += h[i][j] * h[j][n - 1];
          sa += h[i][j] * h[j][n];
        }
        const w = h[i][i] - p;
        if (im[i] < 0) {
          z = w;
          r = ra;
          s = sa;
          continue;
        }
        l = i;
        if (im[i] === 0) {
          [h[i][n - 1], h[i][n]] = divided(-ra, -sa, w, q);
        } else {
          const x = h[i][i + 1];
          const y = h[i + 1][i];
          let vr = (re[i] - p) * (re[i] - p) + im[i] * im[i] - q * q;
          const vi = (re[i] - p) * 2 * q;
          if (vr === 0 && vi === 0) {
            vr = eps * norm * (Math.abs(w) + Math.abs(q) + Math.abs(x) + Math.abs(y) + Math.abs(z));
          }
          [h[i][n - 1], h[i][n]] = divided(x * r - z * ra + q * sa, x * s - z * sa - q * ra, vr, vi);
          if (Math.abs(x) > Math.abs(z) + Math.abs(q)) {
            h[i + 1][n - 1] = (-ra - w * h[i][n - 1] + q * h[i][n]) / x;
            h[i + 1][n] = (-sa - w * h[i][n] - q * h[i][n - 1]) / x;
          } else {
            [h[i + 1][n - 1], h[i + 1][n]] = divided(-r - y * h[i][n - 1], -s - y * h[i][n], z, q);
          }
        }
        const t = Math.max(Math.abs(h[i][n - 1]), Math.abs(h[i][n]));
        if (eps * t * t > 1) {
          for (let j = i; j <= n; j++) {
            h[j][n - 1] /= t;
            h[j][n] /= t;
          }
        }
      }
    }
  }
  for (let j = nn - 1; j >= 0; j--) {
    for (let i = 0; i < nn; i++) {
      z = 0;
      for (let k = 0; k <= j; k++) z += v[i][k] * h[k][j];
      v[i][j] = z;
    }
  }
}
