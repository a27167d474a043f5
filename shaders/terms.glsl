// The shading terms of the layered crown: one text, compiled as GLSL, as C++ double and as ceres::Jet (docs/forward_model.md).
//
// Subset of GLSL that all three accept: only Float, int, TERM and OUT(T); no vectors, uniforms, #version or #include;
// Float(0.0) where a constant is returned, assigned or chosen by ?:; define before use; no `f` suffix; max, min, clamp
// are members of the C++ wrapper. Cosines are positive on the side the vector points to. Lengths in mm, coefficients in 1/mm.

#define TERM_PI 3.14159265358979323846

// (1 - exp(-x)) / x, 1 at x = 0; any sign of x. Series below 0.05 (error < 1e-13): no cancellation in single precision.
TERM Float ExpRatio(Float x) {
  if (abs(x) < 0.05)
    return 1.0 - x * (0.5 - x * (1.0 / 6.0 - x * (1.0 / 24.0 - x * (1.0 / 120.0 - x * (1.0 / 720.0 - x * (1.0 / 5040.0))))));
  return (1.0 - exp(-x)) / x;
}

// Unpolarised Fresnel reflectance of a dielectric boundary, relative_ior = n_behind / n_before; 1 beyond the critical
// angle. The form of theory: no cancellation for relative_ior -> 1 (thesis 3.3-3.5 in exact arithmetic).
TERM Float FresnelReflectance(Float cosine, Float relative_ior) {
  Float c = clamp(cosine, Float(0.0), Float(1.0));
  Float s2 = (1.0 - c) * (1.0 + c);
  Float n2 = relative_ior * relative_ior;
  if (s2 >= n2) return Float(1.0);
  Float u = sqrt(max(n2 - s2, Float(1e-12)));
  Float rs = (1.0 - n2) / ((c + u) * (c + u));
  Float q = (c * u - s2) / (c * u + s2);
  return 0.5 * rs * rs * (1.0 + q * q);
}

// Cosine behind a boundary (Snell); 0 beyond the critical angle.
TERM Float RefractedCosine(Float cosine, Float relative_ior) {
  Float c = clamp(cosine, Float(0.0), Float(1.0));
  Float s = (1.0 - c) * (1.0 + c) / (relative_ior * relative_ior);
  return sqrt(max(1.0 - s, Float(1e-12)));
}

// Henyey and Greenstein 1941, per steradian, integrates to 1 (thesis 3.12, whose print lacks the square of g).
TERM Float HenyeyGreenstein(Float g, Float cosine) {
  Float b = (1.0 - g) * (1.0 - g) + 2.0 * g * (1.0 - cosine);
  return (1.0 - g * g) / (4.0 * TERM_PI * b * sqrt(b));
}

// GGX distribution of normals, per steradian (Walter et al. 2007, eq. 33), in the form that keeps digits at the peak.
TERM Float GgxDistribution(Float cos_half, Float roughness) {
  Float c2 = cos_half * cos_half;
  Float a2 = roughness * roughness;
  Float b = (1.0 - c2) + a2 * c2;
  return a2 / (TERM_PI * b * b);
}

// Height-correlated Smith shadowing over 4 cos cos (Heitz 2014, eq. 99).
TERM Float GgxVisibility(Float cos_light, Float cos_view, Float roughness) {
  Float a2 = roughness * roughness;
  Float v = cos_light * sqrt(cos_view * cos_view * (1.0 - a2) + a2);
  Float l = cos_view * sqrt(cos_light * cos_light * (1.0 - a2) + a2);
  return 0.5 / max(v + l, Float(1e-9));
}

// Surface reflection, per steradian: single scattering on GGX facets. What facets pass on to each other is lost: at normal
// incidence 1 % of the reflection at roughness 0.1, 10 % at 0.3, 31 % at 0.5.
TERM Float SurfaceReflection(Float cos_light, Float cos_view, Float cos_half, Float cos_light_half, Float roughness,
                             Float relative_ior) {
  return GgxDistribution(cos_half, roughness) * GgxVisibility(cos_light, cos_view, roughness) *
         FresnelReflectance(cos_light_half, relative_ior);
}

// Light that is left of a beam after `path_mm` in a medium of extinction `extinction_per_mm` (zeroth order, thesis 3.24).
TERM Float Attenuation(Float extinction_per_mm, Float path_mm) { return exp(-extinction_per_mm * path_mm); }

// Hanrahan and Krueger 1993 first-order scattering of a layer, geometry factor of reflection: (1 - e^-..) / (mu0 + mu),
// branch-free in all limits. tau: optical thickness; mu0, mu: cosines inside. Thesis 3.27 with its numerator mu0 -> 1.
TERM Float SingleScatterBackward(Float tau, Float mu0, Float mu) {
  return tau / (mu0 * mu) * ExpRatio(tau * (1.0 / mu0 + 1.0 / mu));
}

// The same for transmission: (e^-tau/mu0 - e^-tau/mu) / (mu0 - mu); mu -> mu0 is no special case (thesis 3.28, 3.29).
TERM Float SingleScatterForward(Float tau, Float mu0, Float mu) {
  Float a = tau / mu0;
  Float b = tau / mu;
  return tau / (mu0 * mu) * exp(-min(a, b)) * ExpRatio(abs(a - b));
}

// First-order BRDF of a layer below a boundary of relative_ior, per steradian. `transmitted` is the product of both
// Fresnel transmittances; phase per steradian; the 1/n^2 of radiance leaving the layer is the factor the thesis lacks.
TERM Float SingleScatterReflection(Float albedo, Float phase, Float transmitted, Float relative_ior, Float tau, Float mu0,
                                   Float mu) {
  return transmitted * albedo * phase * SingleScatterBackward(tau, mu0, mu) / (relative_ior * relative_ior);
}

// Diffusion coefficient, mm (Ripoll et al. 2005; thesis 4.14). For Henyey-Greenstein ss (1 - g^2) = ss' (1 + g).
TERM Float DiffusionCoefficient(Float reduced_scattering, Float absorption, Float g) {
  Float higher = 0.8 * absorption / (reduced_scattering * (1.0 + g) + absorption);
  return 1.0 / (3.0 * (reduced_scattering + absorption) * (1.0 - higher));
}

// Squared effective transport coefficient, 1/mm^2; kept above 1e-8 so that square roots keep their derivatives.
TERM Float TransportSquared(Float absorption, Float diffusion_mm) {
  return max(absorption / diffusion_mm, Float(1e-8));
}

// Share of the light leaving through a boundary plane within `radius_mm` of the axis, for one point source at `depth_mm`
// on one side of the plane (negative: beyond it) in an infinite medium: integral of the dipole's bracket (Jensen et al.
// 2001) over the disk, z/2 (e^-k|z| / |z| - e^-kd / d). Closed form, so rings of the profile need no quadrature.
TERM Float PointSourceFlux(Float transport, Float depth_mm, Float radius_mm) {
  Float z = abs(depth_mm);
  Float d = sqrt(z * z + radius_mm * radius_mm);
  Float within = 0.5 * (exp(-transport * z) - z / max(d, Float(1e-12)) * exp(-transport * d));
  return depth_mm < 0.0 ? -within : within;
}

// Total diffuse reflectance of a slab for a collimated source ss' e^-st'z (d'Eon and Irving 2011 for the source,
// Donner and Jensen 2005 for the boundaries; summed in closed form). zb: extrapolation distances 2 A D of both sides.
TERM Float SlabReflectance(Float reduced_scattering, Float extinction, Float transport, Float thickness_mm, Float zb_front,
                           Float zb_back) {
  Float d = thickness_mm;
  Float k = transport;
  Float length = d + zb_front + zb_back;
  Float near = ExpRatio((extinction + k) * d);
  Float far = exp(-2.0 * k * (d + zb_back)) * ExpRatio((extinction - k) * d);
  return reduced_scattering * d * 0.5 * (1.0 + exp(-2.0 * k * zb_front)) * (near - far) / (1.0 - exp(-2.0 * k * length));
}

// Total transmittance of the same slab, light that was never scattered included.
TERM Float SlabTransmittance(Float reduced_scattering, Float extinction, Float transport, Float thickness_mm,
                             Float zb_front, Float zb_back) {
  Float d = thickness_mm;
  Float k = transport;
  Float length = d + zb_front + zb_back;
  Float near = exp(-k * d) * ExpRatio((extinction - k) * d);
  Float far = exp(-k * (d + 2.0 * zb_front)) * ExpRatio((extinction + k) * d);
  Float diffuse = reduced_scattering * d * 0.5 * (1.0 + exp(-2.0 * k * zb_back)) * (near - far) / (1.0 - exp(-2.0 * k * length));
  return diffuse + exp(-extinction * d);
}

// Radiance leaving per radiant exitance of the diffusing layer, per steradian: (1 - F) / (pi (1 - Fdr)); without the
// normalisation by the diffuse Fresnel reflectance Fdr (from outside) 11 % of the light of a tooth is lost.
TERM Float ExitLobe(Float cos_view, Float relative_ior, Float diffuse_fresnel_outside) {
  return (1.0 - FresnelReflectance(cos_view, relative_ior)) / (TERM_PI * (1.0 - diffuse_fresnel_outside));
}
