// The shading terms against published values (docs/forward_model.md names the sources) and limits.

#include <gtest/gtest.h>

#include <cmath>
#include <glm/glm.hpp>
#include <numbers>

#include "base/random.h"
#include "optics/fresnel_moments.h"
#include "optics/shading_terms.h"

namespace crownfit {
namespace {

using D = Terms<double>;
constexpr double kPi = std::numbers::pi;

TEST(Fresnel, MatchesPublishedValuesAndTotalReflection) {
  EXPECT_NEAR(D::FresnelReflectance(1.0, 1.5), 0.04, 1e-12);
  EXPECT_NEAR(D::FresnelReflectance(0.5, 1.5), 0.0891867128, 1e-10);
  EXPECT_NEAR(D::FresnelReflectance(0.2, 1.5), 0.338894, 1e-6);
  EXPECT_NEAR(D::FresnelReflectance(0.8, 1.0 / 1.5), 0.11414110022, 1e-10);
  EXPECT_EQ(D::FresnelReflectance(0.5, 1.0 / 1.5), 1.0);
  EXPECT_NEAR(D::FresnelReflectance(0.0, 1.5), 1.0, 1e-12);
}

TEST(Fresnel, IsReciprocalAndZeroForEqualIndices) {
  for (double c : {0.1, 0.35, 0.8, 1.0}) {
    const double inside = D::RefractedCosine(c, 1.62);
    EXPECT_NEAR(D::FresnelReflectance(c, 1.62), D::FresnelReflectance(inside, 1.0 / 1.62), 1e-12);
    EXPECT_NEAR(D::FresnelReflectance(c, 1.0 + 1e-9), 0.0, 1e-14);
  }
}

TEST(Fresnel, MomentsOverTheHemisphereMatchPublishedQuadratures) {
  struct Row {
    double n, outside, inside, a;
  };
  for (const auto& [n, outside, inside, a] :
       {Row{1.05, 0.01388565, 0.10556521, 1.23605}, Row{1.33, 0.06593085, 0.47194915, 2.78751},
        Row{1.5, 0.09177796, 0.59634576, 3.95474}, Row{1.54, 0.09761731, 0.61950469, 4.25631},
        Row{1.62, 0.10908968, 0.66052800, 4.89150}, Row{2.0, 0.16059664, 0.79014916, 8.53058}}) {
    const auto m = MomentsOf(n);
    EXPECT_NEAR(m.diffuse_outside, outside, 1e-7) << n;
    EXPECT_NEAR(m.diffuse_inside, inside, 1e-7) << n;
    EXPECT_NEAR(m.boundary_A, a, 1e-5) << n;
  }
  EXPECT_NEAR(MomentsOf(1.0 + 1e-9).boundary_A, 1.0, 1e-6);
}

TEST(Phase, HenyeyGreensteinIntegratesToOneWithMeanCosineG) {
  const auto& q = UnitIntervalQuadrature();
  for (double g : {-0.5, 0.0, 0.5, 0.68}) {
    double total = 0, mean = 0;
    for (int half = 0; half < 2; ++half)
      for (size_t i = 0; i < q.node.size(); ++i) {
        const double c = half ? q.node[i] : -q.node[i], w = 2 * kPi * q.weight[i] * D::HenyeyGreenstein(g, c);
        total += w;
        mean += w * c;
      }
    EXPECT_NEAR(total, 1.0, 1e-9);
    EXPECT_NEAR(mean, g, 1e-9);
  }
  EXPECT_NEAR(D::HenyeyGreenstein(0.96, 1.0), (1 - 0.96 * 0.96) / (4 * kPi * std::pow(0.04, 3)), 1e-6);
}

TEST(Surface, GgxIsNormalisedAndConservesEnergy) {
  const auto& q = UnitIntervalQuadrature();
  for (double roughness : {0.15, 0.4, 0.9}) {
    double covered =
        0;  // integral of D cos over the hemisphere; t = tan^2-like substitution by the distribution's own cdf
    for (size_t i = 0; i < q.node.size(); ++i) {
      const double a2 = roughness * roughness, u = q.node[i], c2 = (1 - u) / (1 + (a2 - 1) * u);
      const double density = D::GgxDistribution(std::sqrt(c2), roughness), b = 1 + (a2 - 1) * u;
      covered += q.weight[i] * kPi * density * (a2 / (b * b));  // d(c2)/du = -a2 / b^2, solid angle pi d(c2)
    }
    EXPECT_NEAR(covered, 1.0, 1e-9) << roughness;
  }
  // Directional albedo of a perfect mirror surface at normal incidence, by integration over half vectors.
  // Beckmann's values are 0.990, 0.910, 0.755; GGX with the same roughness stays within 0.10 of them.
  for (const auto& [roughness, beckmann] : {std::pair{0.1, 0.990}, {0.3, 0.910}, {0.5, 0.755}}) {
    double albedo = 0;
    constexpr int kSteps = 2000;
    for (int i = 0; i < kSteps; ++i) {
      const double c = (i + 0.5) / kSteps, light = 2 * c * c - 1;  // half vector at c, view at the normal
      if (light <= 0) continue;
      const double f = D::GgxDistribution(c, roughness) * D::GgxVisibility(light, 1.0, roughness);
      albedo += f * light * 4 * c * 2 * kPi / kSteps;  // solid angle of the light is 4 (l.h) that of the half vector
    }
    EXPECT_LE(albedo, 1.0 + 1e-6);
    EXPECT_NEAR(albedo, beckmann, 0.10);
  }
}

TEST(FirstOrder, HanrahanKruegerMatchesPublishedValuesAndIsReciprocal) {
  struct Row {
    double n, tau, in, out, value;
  };
  for (const auto& [n, tau, in, out, value] : {Row{1, 1, 1, 0.5, 0.05041036}, Row{1.5, 1, 1, 0.5, 0.01518421},
                                               Row{1.62, 0.3, 1, 1, 0.00609583}, Row{1.62, 6, 0.7, 0.6, 0.01467047}}) {
    const auto f = [&](double i, double o) {
      const double t = (1 - D::FresnelReflectance(i, n)) * (1 - D::FresnelReflectance(o, n));
      return D::SingleScatterReflection(1.0, 0.25 / kPi, t, n, tau, D::RefractedCosine(i, n), D::RefractedCosine(o, n));
    };
    EXPECT_NEAR(f(in, out), value, 1e-8);
    EXPECT_NEAR(f(in, out), f(out, in), 1e-14);
  }
}

TEST(FirstOrder, LimitsOfThicknessAndEqualAnglesAreContinuous) {
  EXPECT_NEAR(D::SingleScatterBackward(1e-12, 0.8, 0.6) / 1e-12, 1 / (0.8 * 0.6), 1e-9);
  EXPECT_NEAR(D::SingleScatterBackward(1e6, 0.8, 0.6), 1 / (0.8 + 0.6), 1e-9);
  const double same = D::SingleScatterForward(1.3, 0.7, 0.7);
  EXPECT_NEAR(same, 1.3 / (0.7 * 0.7) * std::exp(-1.3 / 0.7), 1e-12);
  EXPECT_NEAR(D::SingleScatterForward(1.3, 0.7, 0.7 + 1e-9), same, 1e-8);
  EXPECT_NEAR(D::SingleScatterForward(1.3, 0.7, 0.9), (std::exp(-1.3 / 0.7) - std::exp(-1.3 / 0.9)) / (0.7 - 0.9),
              1e-12);
  EXPECT_TRUE(std::isfinite(D::SingleScatterBackward(1.0, 1e-6, 1e-6)));
}

TEST(Diffusion, CoefficientMatchesTheThesisDecayTable) {
  struct Row {
    double g, albedo, value;
  };
  for (const auto& [g, albedo, value] : {Row{0, 0.99, 0.33602}, Row{0, 0.9, 0.36232}, Row{0, 0.5, 0.55556},
                                         Row{0.9, 0.95, 0.34068}, Row{0.9, 0.8, 0.36752}, Row{0.96, 0.9, 0.34828}})
    EXPECT_NEAR(D::DiffusionCoefficient(albedo, 1 - albedo, g), value, 2e-5) << g << " " << albedo;
}

double SlabR(double s, double a, double d, double n) {
  const double diffusion = D::DiffusionCoefficient(s, a, 0.0), zb = 2 * MomentsOf(n).boundary_A * diffusion;
  return D::SlabReflectance(s, s + a, std::sqrt(D::TransportSquared(a, diffusion)), d, zb, zb);
}
double SlabT(double s, double a, double d, double n) {
  const double diffusion = D::DiffusionCoefficient(s, a, 0.0), zb = 2 * MomentsOf(n).boundary_A * diffusion;
  return D::SlabTransmittance(s, s + a, std::sqrt(D::TransportSquared(a, diffusion)), d, zb, zb);
}

TEST(Diffusion, NonAbsorbingSlabConservesEnergy) {
  for (double n : {1.0 + 1e-9, 1.54, 2.1})
    for (double d : {0.01, 0.3, 2.0, 15.0})
      EXPECT_NEAR(SlabR(2, 0, d, n) + SlabT(2, 0, d, n), 1.0, 2e-6) << n << " " << d;
}

TEST(Diffusion, SlabTotalsAreNearAddingDoubling) {
  // Converged adding-doubling at n = 1: (a, b) -> UR1, UT1; diffusion with an extended source is good to a few per
  // cent.
  EXPECT_NEAR(SlabR(0.99, 0.01, 1, 1 + 1e-9), 0.33292, 0.035 * 0.33292);
  EXPECT_NEAR(SlabT(0.99, 0.01, 1, 1 + 1e-9), 0.65098, 0.025 * 0.65098);
  // n = 1.62, a = 0.99, b = 8: UR1 0.55673, UT1 0.14825, of the light that entered (Fresnel 0.0560).
  const double f = D::FresnelReflectance(1.0, 1.62);
  EXPECT_NEAR(SlabR(0.99, 0.01, 8, 1.62), (0.55673 - f) / (1 - f), 0.035 * 0.53);
  EXPECT_NEAR(SlabT(0.99, 0.01, 8, 1.62), 0.14825 / (1 - f), 0.05 * 0.157);
}

TEST(Diffusion, ZeroThicknessTransmitsEverything) {
  EXPECT_NEAR(SlabR(2, 0.1, 0, 1.54), 0.0, 1e-12);
  EXPECT_NEAR(SlabT(2, 0.1, 0, 1.54), 1.0, 1e-12);
  EXPECT_NEAR(SlabR(2, 0.1, 1e-7, 1.54), 0.0, 1e-6);
}

TEST(Diffusion, PointSourceFluxIsTheIntegralOfTheDipoleBracket) {
  const double k = 0.6, z = 0.4;
  const auto bracket = [&](double r) {
    const double d = std::sqrt(r * r + z * z);
    return z * (1 + k * d) * std::exp(-k * d) / (4 * kPi * d * d * d);
  };
  double sum = 0;
  constexpr int kSteps = 200000;
  const double radius = 2.0;
  for (int i = 0; i < kSteps; ++i) {
    const double r = radius * (i + 0.5) / kSteps;
    sum += bracket(r) * 2 * kPi * r * radius / kSteps;
  }
  EXPECT_NEAR(D::PointSourceFlux(k, z, radius), sum, 1e-8);
  EXPECT_NEAR(D::PointSourceFlux(k, z, 1e9), 0.5 * std::exp(-k * z), 1e-9);
  EXPECT_NEAR(D::PointSourceFlux(k, -z, radius), -sum, 1e-8);
}

TEST(Fresnel, ShaderMomentsMatchQuadratureAndPublishedFit) {
  struct Row {
    double n, fluence, a;
  };
  for (const auto& [n, fluence, a] : {Row{1.05, 0.01183664, 1.15773}, Row{1.33, 0.10941284, 2.51536},
                                      Row{1.5, 0.15481017, 3.62793}, Row{1.62, 0.18014796, 4.53776}}) {
    const auto exact = MomentsOf(n);
    EXPECT_NEAR(D::DiffuseFresnelOutside(n), exact.diffuse_outside, 2e-6) << n;
    EXPECT_NEAR(D::DiffuseFresnelInside(n), exact.diffuse_inside, 2e-6) << n;
    EXPECT_NEAR(D::BoundaryParameter(exact.diffuse_inside), exact.boundary_A, 1e-12);
    EXPECT_NEAR(D::FresnelFluenceMomentInside(n), fluence, 2e-6) << n;
    EXPECT_NEAR(D::BoundaryParameterOfMoments(exact.diffuse_inside, fluence), a, 2e-5) << n;
  }
  for (double n : {1.3, 1.5, 1.7}) EXPECT_NEAR(D::DiffuseFresnelFit(n), MomentsOf(n).diffuse_inside, 7e-4) << n;
  EXPECT_NEAR(D::DiffuseFresnelFit(1.5), 0.596811, 1e-6);
  EXPECT_NEAR(D::DiffuseFresnelFit(1 / 1.5), 0.092825, 1e-6);
  EXPECT_NEAR(D::DiffuseFresnelInside(1.0), 0.0, 1e-12);
}

TEST(Fresnel, FilmMatchesPublishedValueAndPlateItsSeries) {
  EXPECT_NEAR(D::FilmReflectance(D::FresnelReflectance(1, 1.5), D::FresnelReflectance(1, 1.3 / 1.5)), 0.0447030, 1e-7);
  EXPECT_NEAR(D::FilmReflectance(0.0, 0.3), 0.3, 1e-12);
  const double f = 0.04, g = 0.1, a = 0.7;
  double series = 0, way = (1 - f) * (1 - g) * a;
  for (int i = 0; i < 40; ++i, way *= f * g * a * a) series += way;
  EXPECT_NEAR(D::ZerothOrderTransmittance(f, g, a), series, 1e-14);
  EXPECT_NEAR(D::FilmReflectance(f, g) + D::ZerothOrderTransmittance(f, g, 1.0), 1.0, 1e-12);
}

TEST(Surface, KelemenConservesEnergyAndMatchesPublishedAlbedo) {
  // Directional albedo with F = 1 (a very dense medium), published in theory for three angles.
  const auto albedo = [](double m, double cos_view) {
    const glm::dvec3 view(std::sqrt(1 - cos_view * cos_view), 0, cos_view);
    double sum = 0;
    constexpr int kPolar = 1500, kAround = 600;
    for (int j = 0; j < kPolar; ++j) {
      for (int i = 0; i < kAround; ++i) {
        const double c = (j + 0.5) / kPolar, s = std::sqrt(1 - c * c), phi = 2 * kPi * (i + 0.5) / kAround;
        const glm::dvec3 light(s * std::cos(phi), s * std::sin(phi), c), half = glm::normalize(light + view);
        sum += D::KelemenReflection(half.z, glm::dot(light, half), m, 1e7) * c * 2 * kPi / (kPolar * kAround);
      }
    }
    return sum;
  };
  EXPECT_NEAR(albedo(0.3, 1.0), 0.910, 2e-3);
  EXPECT_NEAR(albedo(0.3, 0.5), 0.820, 2e-3);
  EXPECT_NEAR(albedo(0.5, 1.0), 0.755, 2e-3);
  EXPECT_NEAR(albedo(0.5, 0.15), 0.78, 6e-3);
  EXPECT_EQ(D::KelemenReflection(0.5, 0.0, 0.3, 1.5), 0.0);
}

TEST(Diffusion, ClassicAndGrosjeanCoefficientsMatchTabulatedValues) {
  EXPECT_NEAR(D::DiffusionCoefficientClassic(0.9, 0.1), 0.33333, 1e-5);
  EXPECT_NEAR(D::DiffusionCoefficientGrosjean(0.9, 0.1), 0.36667, 1e-5);
  EXPECT_NEAR(D::DiffusionCoefficientGrosjean(0.5, 0.5), 0.5, 1e-12);
}

TEST(Diffusion, DipoleMatchesItsClosedFormAndTheDeepMultipole) {
  const double a = 0.95, depth = 0.5, k = 0.7, zb = 1.1;
  double sum = 0;
  constexpr int kSteps = 200000;
  for (int i = 0; i < kSteps; ++i) {
    const double x = (i + 0.5) / kSteps, r = x / (1 - x), dr = 1 / ((1 - x) * (1 - x)) / kSteps;
    sum += D::DipoleProfile(a, depth, k, zb, r) * 2 * kPi * r * dr;
  }
  EXPECT_NEAR(sum, D::DipoleReflectance(a, depth, k, zb), 1e-7);
  EXPECT_NEAR(D::MultipoleReflectance(a, depth, k, 40, zb, zb), D::DipoleReflectance(a, depth, k, zb), 1e-12);
}

TEST(Diffusion, MultipoleSumsItsImagesAndConservesEnergy) {
  const double a = 0.9, depth = 0.4, k = 0.8, d = 1.3, zf = 1.0, zb = 0.6, length = d + zf + zb;
  double r = 0, t = 0;
  for (int i = -60; i <= 60; ++i) {
    const double real = 2 * i * length + depth, image = 2 * i * length - depth - 2 * zf;
    const auto flux = [&](double z) { return D::PointSourceFlux(k, z, 1e9); };
    r += a * (flux(real) - flux(image));
    t += a * (flux(d - real) - flux(d - image));
  }
  EXPECT_NEAR(D::MultipoleReflectance(a, depth, k, d, zf, zb), r, 1e-12);
  EXPECT_NEAR(D::MultipoleTransmittance(a, depth, k, d, zf, zb), t, 1e-12);
  EXPECT_NEAR(D::MultipoleReflectance(1, depth, 0, d, zf, zb), (d + zb - depth) / length, 1e-12);
  EXPECT_NEAR(D::MultipoleReflectance(1, depth, 0, d, zf, zb) + D::MultipoleTransmittance(1, depth, 0, d, zf, zb), 1.0,
              1e-12);
}

TEST(Diffusion, ThinSlabMultipoleMatchesReferenceValues) {
  // n = 1.62, reduced albedo 0.99 (theory): multipole 0.403 and 0.501 at optical thickness 1 and 4, exact 0.309 and
  // 0.488.
  const double diffusion = D::DiffusionCoefficientClassic(0.99, 0.01), zb = 2 * MomentsOf(1.62).boundary_A * diffusion;
  const double k = std::sqrt(0.01 / diffusion);
  EXPECT_NEAR(D::MultipoleReflectance(0.99, 1, k, 1, zb, zb), 0.403, 1.5e-3);
  EXPECT_NEAR(D::MultipoleReflectance(0.99, 1, k, 4, zb, zb), 0.501, 1.5e-3);
}

TEST(Diffusion, NormalisedDiffusionIntegratesToItsAlbedo) {
  const double albedo = 0.6, path = 0.7, radius = 2.0;
  double sum = 0;
  constexpr int kSteps = 100000;
  for (int i = 0; i < kSteps; ++i) {
    const double r = radius * (i + 0.5) / kSteps;
    sum += D::NormalisedDiffusionProfile(albedo, path, r) * 2 * kPi * r * radius / kSteps;
  }
  EXPECT_NEAR(sum, albedo * D::NormalisedDiffusionWithin(albedo, path, radius), 1e-8);
  EXPECT_NEAR(D::NormalisedDiffusionWithin(albedo, path, 1e3), 1.0, 1e-12);
  // Root mean square radius sqrt(14) L / s; at albedo 0.5355 2.59 free paths.
  EXPECT_NEAR(std::sqrt(14.0) / D::NormalisedDiffusionShape(0.5355), 2.59, 0.01);
}

TEST(Taps, HableOffsetsMatchPublishedValues) {
  EXPECT_EQ(D::HableTapX(0), 0.0);
  EXPECT_EQ(D::HableTapX(7), 5.970690);
  EXPECT_EQ(D::HableTapY(12), -3.245901);
}

}  // namespace
}  // namespace crownfit
