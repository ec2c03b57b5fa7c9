// What the compiled kernel calls beside arithmetic: fused multiply-add, square root, and memory for its work arrays.

typedef unsigned long long u64;

static double of_bits(u64 bits) { union { u64 u; double d; } x = {.u = bits}; return x.d; }
static u64 bits_of(double value) { union { double d; u64 u; } x = {.d = value}; return x.u; }

// a * b + c with one rounding. WebAssembly has no such operation. Products and sums are split without error (Dekker, Knuth) and the low
// parts are added with rounding to odd, which makes the last rounding right: S. Boldo and G. Melquiond, "Emulation of FMA and correctly
// rounded sums: proved algorithms using rounding to odd", IEEE Trans. Comput. 57 (2008), 462-471.
double fused_multiply_add(double a, double b, double c) {
  const double huge = 0x1p480, tiny = 0x1p-480;
  double product = a * b, size = __builtin_fabs(product);
  if (a == 0.0 || b == 0.0) return product + c;
  int is_ordinary = (size < huge) & (size > tiny) & (__builtin_fabs(a) < huge) & (__builtin_fabs(b) < huge) &
                    (__builtin_fabs(c) < huge);
  if (!is_ordinary) return __builtin_fma(a, b, c);  // the compiler's own, slow

  const double split = 0x1p27 + 1.0;
  double t = split * a, a1 = t - (t - a), a2 = a - a1;
  t = split * b;
  double b1 = t - (t - b), b2 = b - b1;
  double rest = a2 * b2 - (((product - a1 * b1) - a2 * b1) - a1 * b2);

  double low = c + rest, of_rest = low - c;
  double low_error = (c - (low - of_rest)) + (rest - of_rest);
  double high = product + low, of_low = high - product;
  double high_error = (product - (high - of_low)) + (low - of_low);

  double sum = high_error + low_error, part = sum - high_error;
  double error = (high_error - (sum - part)) + (low_error - part);
  u64 bits = bits_of(sum);
  if (error != 0.0 && !(bits & 1)) bits += ((error > 0.0) == (sum > 0.0)) ? 1 : -1;
  return high + of_bits(bits);
}

double sqrt(double x) { return __builtin_sqrt(x); }

// Numba's work arrays: a block holds what Numba looks for at the offsets of a 64-bit machine, and lives until the next call from outside.
typedef struct { u64 owners, destructor, destructor_info, data, size; } Block;

static _Alignas(64) unsigned char arena[1 << 20];
static unsigned used;

void forget_blocks(void) { used = 0; }

void *NRT_MemInfo_alloc_aligned(u64 size, unsigned alignment) {
  unsigned first = (used + sizeof(Block) + 63) & ~63u;
  if (first + size > sizeof arena) __builtin_trap();
  used = first + (unsigned)size;
  Block *block = (Block *)(arena + first - sizeof(Block));
  block->owners = 1;
  block->destructor = block->destructor_info = 0;
  block->data = (u64)(unsigned)(arena + first);
  block->size = size;
  return block;
}

void NRT_incref(void *block) { (void)block; }
void NRT_decref(void *block) { (void)block; }

// Where the page writes rows of inputs and reads results.
static double rows[1 << 16];
double *shared_rows(void) { return rows; }
unsigned shared_size(void) { return sizeof rows / sizeof *rows; }
