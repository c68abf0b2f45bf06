#include "worker/solver/chain/elastic_kernel.h"

namespace oblique::solver {

ElasticConstants<double> elastic_constants(double length_m, double half_EA_length, double bending) {
  const double l = length_m;
  const double S = 2.0 * half_EA_length;
  ElasticConstants<double> k{};
  k.two_inverse_length = 2.0 / l;
  k.k00 = -S / (2.0 * l * l);
  k.k00_uu = S / (2.0 * l * l * l * l);
  k.k00_dd = S / (24.0 * l * l);
  k.k00_tt = S / (40.0 * l * l);
  k.k01_ud = S / (12.0 * l * l);
  k.k01_dt = S / (60.0 * l);
  k.k02_ut = S / (20.0 * l * l);
  k.k02_dd = S / (120.0 * l);
  k.k02_tt = S / (280.0 * l);
  k.k11 = 0.5 * bending;
  k.k11_k00 = l * l / 12.0;
  k.k11_k02 = l / 3.0;
  k.k12_k01 = l / 5.0;
  k.k12_dt = 9.0 * S / 2800.0;
  k.k22 = 1.5 * bending;
  k.k22_k00 = l * l / 20.0;
  k.k22_k02 = l / 7.0;
  k.k22_tt = 9.0 * S / 9800.0;
  return k;
}

}  // namespace oblique::solver
