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
// angle. No cancellation for relative_ior -> 1 nor towards grazing (thesis 3.3-3.5 in exact arithmetic): n^2 - sin^2 is
// taken as (n^2 - 1) + cos^2.
TERM Float FresnelReflectance(Float cosine, Float relative_ior) {
  Float c = clamp(cosine, Float(0.0), Float(1.0));
  Float s2 = (1.0 - c) * (1.0 + c);
  Float step = (relative_ior - 1.0) * (relative_ior + 1.0);
  Float u2 = step + c * c;
  if (u2 <= 0.0) return Float(1.0);
  Float u = sqrt(max(u2, Float(1e-12)));
  Float rs = -step / ((c + u) * (c + u));
  Float q = (c * u - s2) / (c * u + s2);
  return 0.5 * rs * rs * (1.0 + q * q);
}

// Fresnel transmittance, 1 - FresnelReflectance, without cancellation at grazing incidence.
TERM Float FresnelTransmittance(Float cosine, Float relative_ior) {
  Float c = clamp(cosine, Float(0.0), Float(1.0));
  Float u2 = (relative_ior - 1.0) * (relative_ior + 1.0) + c * c;
  if (u2 <= 0.0) return Float(0.0);
  Float u = sqrt(max(u2, Float(1e-12)));
  Float n2 = relative_ior * relative_ior;
  Float across = c + u;
  Float along = n2 * c + u;
  return 2.0 * c * u * (1.0 / (across * across) + n2 / (along * along));
}

// Cosine behind a boundary (Snell); 0 beyond the critical angle.
TERM Float RefractedCosine(Float cosine, Float relative_ior) {
  Float c = clamp(cosine, Float(0.0), Float(1.0));
  Float u2 = (relative_ior - 1.0) * (relative_ior + 1.0) + c * c;
  return sqrt(max(u2, Float(1e-12))) / relative_ior;
}

// Reflectance of two boundaries, of reflectances `first` and `second`, with a thin, clear film between them: the saliva
// on a tooth. Sums all reflections without interference.
TERM Float FilmReflectance(Float first, Float second) {
  return (first + second - 2.0 * first * second) / max(1.0 - first * second, Float(1e-12));
}

// Reflectance of a surface with the fraction `wetness` of its area under such a film, smooth and of index film_ior.
// Both indices are relative to the outside.
TERM Float WetReflectance(Float cosine, Float relative_ior, Float film_ior, Float wetness) {
  Float dry = FresnelReflectance(cosine, relative_ior);
  Float below = FresnelReflectance(RefractedCosine(cosine, film_ior), relative_ior / film_ior);
  return dry + wetness * (FilmReflectance(FresnelReflectance(cosine, film_ior), below) - dry);
}

// Unscattered transmittance of a clear or absorbing layer, with all reflections between its two boundaries (zeroth
// order; thesis 3.26 leaves the reflections out). attenuation: of one pass.
TERM Float ZerothOrderTransmittance(Float first, Float second, Float attenuation) {
  return (1.0 - first) * (1.0 - second) * attenuation / max(1.0 - first * second * attenuation * attenuation, Float(1e-12));
}

// Integral of F(w) w^order dw over the cosines 0..1 on the rare side, order 1 or 2; relative_ior = n_dense /
// n_rare > 1. Midpoint rule in t with w = t^3 (10 - 15 t + 6 t^2): smooth at both ends, so 48 points reach 1e-6.
TERM Float FresnelMomentOutside(Float relative_ior, int order) {
  Float sum = Float(0.0);
  for (int i = 0; i < 48; ++i) {
    Float t = (Float(i) + 0.5) / 48.0;
    Float w = t * t * t * (10.0 - 15.0 * t + 6.0 * t * t);
    Float weight = 30.0 * t * t * (1.0 - t) * (1.0 - t) / 48.0;
    sum += weight * w * FresnelReflectance(w, relative_ior) * (order == 2 ? w : Float(1.0));
  }
  return sum;
}

// Diffuse Fresnel reflectance 2 int F mu dmu (thesis 4.19 with the 1/pi its print lacks) for light from the rare side ...
TERM Float DiffuseFresnelOutside(Float relative_ior) { return 2.0 * FresnelMomentOutside(relative_ior, 1); }

// ... and from the dense side, total reflection included: exact by etendue.
TERM Float DiffuseFresnelInside(Float relative_ior) {
  return 1.0 - (1.0 - DiffuseFresnelOutside(relative_ior)) / (relative_ior * relative_ior);
}

// Second moment from the dense side, int F mu^2 dmu, by the change of variable that follows Snell's law.
TERM Float FresnelFluenceMomentInside(Float relative_ior) {
  Float n2 = relative_ior * relative_ior;
  Float sum = Float(0.0);
  for (int i = 0; i < 48; ++i) {
    Float t = (Float(i) + 0.5) / 48.0;
    Float w = t * t * t * (10.0 - 15.0 * t + 6.0 * t * t);
    Float weight = 30.0 * t * t * (1.0 - t) * (1.0 - t) / 48.0;
    sum += weight * w * FresnelReflectance(w, relative_ior) * sqrt(max(1.0 - (1.0 - w * w) / n2, Float(1e-12)));
  }
  Float critical = max(1.0 - 1.0 / n2, Float(1e-12));
  return critical * sqrt(critical) / 3.0 + sum / n2;
}

// The published fit (Egan and Hilgeman 1979; thesis 4.20) for light that leaves a medium of relative index
// ior = n_inside / n_outside > 1 (its eta >= 1 branch), or enters it (ior < 1). Within 6e-4 for 1.3..1.7, 0.0017 at 1.
TERM Float DiffuseFresnelFit(Float ior) {
  Float r = 1.0 / ior;
  if (ior < 1.0) return -0.4399 + r * (0.7099 + r * (-0.3319 + r * 0.0636));
  return 0.6681 + 0.0636 * ior + r * (0.7099 - 1.4399 * r);
}

// Boundary parameter A of the extrapolation distance 2 A D: from the flux alone (Groenhuis et al. 1983), or consistent in
// flux and fluence (Aronson 1995; Contini et al. 1997).
TERM Float BoundaryParameter(Float diffuse_inside) { return (1.0 + diffuse_inside) / (1.0 - diffuse_inside); }
TERM Float BoundaryParameterOfMoments(Float diffuse_inside, Float fluence_moment_inside) {
  return (1.0 + 3.0 * fluence_moment_inside) / (1.0 - diffuse_inside);
}

// Henyey and Greenstein 1941, per steradian, integrates to 1 (thesis 3.12, whose print lacks the square of g).
TERM Float HenyeyGreenstein(Float g, Float cosine) {
  Float b = (1.0 - g) * (1.0 - g) + 2.0 * g * (1.0 - cosine);
  return (1.0 - g * g) / (4.0 * TERM_PI * b * sqrt(b));
}

// GGX distribution of normals, per steradian (Walter et al. 2007, eq. 33). From the squared sine and cosine of the half
// angle, which avoids cancellation at the peak ...
TERM Float GgxOfSquares(Float sine2, Float cosine2, Float roughness) {
  Float a2 = roughness * roughness;
  Float b = sine2 + a2 * cosine2;
  return a2 / (TERM_PI * b * b);
}

// ... and from its cosine.
TERM Float GgxDistribution(Float cos_half, Float roughness) {
  return GgxOfSquares((1.0 - cos_half) * (1.0 + cos_half), cos_half * cos_half, roughness);
}

// Height-correlated Smith shadowing over 4 cos cos (Heitz 2014, eq. 99).
TERM Float GgxVisibility(Float cos_light, Float cos_view, Float roughness) {
  Float a2 = roughness * roughness;
  Float v = cos_light * sqrt(cos_view * cos_view * (1.0 - a2) + a2);
  Float l = cos_view * sqrt(cos_light * cos_light * (1.0 - a2) + a2);
  return 0.5 / max(v + l, Float(1e-9));
}

// Surface reflection, per steradian: single scattering on GGX facets. Light scattered between facets is lost: at normal
// incidence 1 % of the reflection at roughness 0.1, 10 % at 0.3, 31 % at 0.5.
TERM Float SurfaceReflection(Float cos_light, Float cos_view, Float cos_half, Float cos_light_half, Float roughness,
                             Float relative_ior) {
  return GgxDistribution(cos_half, roughness) * GgxVisibility(cos_light, cos_view, roughness) *
         FresnelReflectance(cos_light_half, relative_ior);
}

// The same for a rough surface seen through the film: directions are refracted into the film. The specular reflection
// of the film's upper side is not included. Reflections between film and surface are neglected (below 1 % of these).
TERM Float SurfaceReflectionUnderFilm(Float cos_light, Float cos_view, Float cos_half, Float cos_light_half,
                                      Float roughness, Float relative_ior, Float film_ior) {
  Float light = RefractedCosine(cos_light, film_ior);
  Float view = RefractedCosine(cos_view, film_ior);
  Float sum = 2.0 * cos_light_half;  // length of light + view in air
  Float along = sum * sum * max((1.0 - cos_half) * (1.0 + cos_half), Float(0.0)) / (film_ior * film_ior);
  Float up = (light + view) * (light + view);
  Float square = max(along + up, Float(1e-12));
  Float passed = FresnelTransmittance(cos_light, film_ior) * FresnelTransmittance(cos_view, film_ior);
  return passed / (film_ior * film_ior) * GgxOfSquares(along / square, up / square, roughness) *
         GgxVisibility(light, view, roughness) * FresnelReflectance(0.5 * sqrt(square), relative_ior / film_ior);
}

// Beckmann distribution of normals, per steradian.
TERM Float BeckmannDistribution(Float cos_half, Float roughness) {
  Float c2 = max(cos_half * cos_half, Float(1e-8));
  Float m2 = roughness * roughness;
  return exp(-(1.0 - c2) / (c2 * m2)) / (TERM_PI * m2 * c2 * c2);
}

// The thesis's surface reflection, per steradian: Kelemen and Szirmay-Kalos 2001, Beckmann facets with the geometry
// factor folded into 1 / |light + view|^2 = 1 / (4 cos_light_half^2). 0 where light and view face each other.
TERM Float KelemenReflection(Float cos_half, Float cos_light_half, Float roughness, Float relative_ior) {
  Float square = 4.0 * cos_light_half * cos_light_half;
  if (square < 1e-8) return Float(0.0);
  return BeckmannDistribution(cos_half, roughness) * FresnelReflectance(cos_light_half, relative_ior) / square;
}

// Fraction of a beam left after `path_mm` in a medium of extinction `extinction_per_mm` (zeroth order, thesis 3.24).
TERM Float Attenuation(Float extinction_per_mm, Float path_mm) { return exp(-extinction_per_mm * path_mm); }

// Hanrahan and Krueger 1993 first-order scattering of a layer, geometry factor of reflection: (1 - e^-..) / (mu0 + mu),
// branch-free in all limits. tau: optical thickness; mu0, mu: cosines inside. Thesis 3.27 with its numerator mu0 -> 1.
TERM Float SingleScatterBackward(Float tau, Float mu0, Float mu) {
  return tau / (mu0 * mu) * ExpRatio(tau * (1.0 / mu0 + 1.0 / mu));
}

// The same for transmission: (e^-tau/mu0 - e^-tau/mu) / (mu0 - mu); mu -> mu0 is no special case (thesis 3.28, 3.29).
// Two branches, because min and abs would lose the derivative where a = b.
TERM Float SingleScatterForward(Float tau, Float mu0, Float mu) {
  Float a = tau / mu0;
  Float b = tau / mu;
  Float both = tau / (mu0 * mu);
  if (a < b) return both * exp(-a) * ExpRatio(b - a);
  return both * exp(-b) * ExpRatio(a - b);
}

// First-order BRDF of a layer below a boundary of relative_ior, per steradian. `transmitted` is the product of both
// Fresnel transmittances; phase per steradian. The 1/n^2 of radiance leaving the layer is missing in the thesis.
TERM Float SingleScatterReflection(Float albedo, Float phase, Float transmitted, Float relative_ior, Float tau, Float mu0,
                                   Float mu) {
  return transmitted * albedo * phase * SingleScatterBackward(tau, mu0, mu) / (relative_ior * relative_ior);
}

// Diffusion coefficient, mm (Ripoll et al. 2005; thesis 4.14). For Henyey-Greenstein ss (1 - g^2) = ss' (1 + g).
TERM Float DiffusionCoefficient(Float reduced_scattering, Float absorption, Float g) {
  Float higher = 0.8 * absorption / (reduced_scattering * (1.0 + g) + absorption);
  return 1.0 / (3.0 * (reduced_scattering + absorption) * (1.0 - higher));
}

// The classic coefficient 1 / (3 st'), and Grosjean's as used by d'Eon and Irving 2011.
TERM Float DiffusionCoefficientClassic(Float reduced_scattering, Float absorption) {
  return 1.0 / (3.0 * (reduced_scattering + absorption));
}
TERM Float DiffusionCoefficientGrosjean(Float reduced_scattering, Float absorption) {
  Float extinction = reduced_scattering + absorption;
  return (2.0 * absorption + reduced_scattering) / (3.0 * extinction * extinction);
}

// Squared effective transport coefficient, 1/mm^2; at least 1e-8, so that its square root stays differentiable.
TERM Float TransportSquared(Float absorption, Float diffusion_mm) {
  return max(absorption / diffusion_mm, Float(1e-8));
}

// Share of the light leaving through a boundary plane within `radius_mm` of the axis, for one point source at `depth_mm`
// on one side of the plane (negative: beyond it) in an infinite medium: integral of the dipole's bracket (Jensen et al.
// 2001) over the disk, z/2 (e^-k|z| / |z| - e^-kd / d). Closed form, so rings of the profile need no quadrature.
TERM Float PointSourceFlux(Float transport, Float depth_mm, Float radius_mm) {
  Float z = abs(depth_mm);
  Float d = sqrt(z * z + radius_mm * radius_mm);
  Float beyond = radius_mm * radius_mm / max(d + z, Float(1e-12));  // d - z without cancellation
  Float within = 0.5 * exp(-transport * z) * beyond / max(d, Float(1e-12)) *
                 (1.0 + transport * z * ExpRatio(transport * beyond));
  return depth_mm < 0.0 ? -within : within;
}

// exp(-k d) ExpRatio((extinction - k) d), which is symmetric in both and has no large parts to cancel.
TERM Float DecayBetween(Float extinction, Float k, Float d) {
  if (k < extinction) return exp(-k * d) * ExpRatio((extinction - k) * d);
  return exp(-extinction * d) * ExpRatio((k - extinction) * d);
}

// Second divided difference of exp at a, k and -k, abs(a) + k < 0.15: sum of h_n / (n + 2)!, h_n their complete homogeneous
// polynomial (error < 1e-12).
TERM Float SmallExpDifference(Float a, Float k) {
  Float h2 = a * a + k * k;
  Float h4 = a * a * h2 + k * k * k * k;
  Float h6 = a * a * h4 + k * k * k * k * k * k;
  return 0.5 + a / 6.0 + h2 / 24.0 + a * h2 / 120.0 + h4 / 720.0 + a * h4 / 5040.0 + h6 / 40320.0 + a * h6 / 362880.0;
}

// Total diffuse reflectance of a slab for a collimated source ss' e^-st'z (d'Eon and Irving 2011 for the source, Donner
// and Jensen 2005 for the boundaries). Summed in closed form; near and far images are subtracted analytically, without
// cancellation. zb: extrapolation distances 2 A D of both sides.
TERM Float SlabReflectance(Float reduced_scattering, Float extinction, Float transport, Float thickness_mm, Float zb_front,
                           Float zb_back) {
  Float d = thickness_mm;
  Float k = transport;
  Float length = d + zb_front + zb_back;
  Float decay = exp(-k * d) * DecayBetween(extinction, k, d);
  Float sum = (extinction + k) * d;
  Float within = sum < 0.15 ? exp(-k * d) * SmallExpDifference(-extinction * d, k * d) : (ExpRatio(2.0 * k * d) - decay) / sum;
  return reduced_scattering * d * 0.5 * (1.0 + exp(-2.0 * k * zb_front)) *
         (d * within + zb_back * decay * ExpRatio(2.0 * k * zb_back)) / (length * ExpRatio(2.0 * k * length));
}

// Total transmittance of the same slab, including unscattered light.
TERM Float SlabTransmittance(Float reduced_scattering, Float extinction, Float transport, Float thickness_mm,
                             Float zb_front, Float zb_back) {
  Float d = thickness_mm;
  Float k = transport;
  Float length = d + zb_front + zb_back;
  Float sum = (extinction + k) * d;
  Float within = sum < 0.15 ? exp(-sum) * SmallExpDifference(extinction * d, k * d)
                            : (DecayBetween(extinction, k, d) - exp(-extinction * d) * ExpRatio(2.0 * k * d)) / sum;
  Float diffuse = reduced_scattering * d * 0.5 * (1.0 + exp(-2.0 * k * zb_back)) *
                  (d * within + zb_front * exp(-k * d) * ExpRatio(sum) * ExpRatio(2.0 * k * zb_front)) /
                  (length * ExpRatio(2.0 * k * length));
  return diffuse + exp(-extinction * d);
}

// Tables over thickness have nodes at equal steps of ln(thickness + 0.1 mm): the table coordinate of a thickness, and
// its inverse.
TERM Float TablePlace(Float thickness_mm) { return 4.0 * log(1.0 + 10.0 * thickness_mm); }
TERM Float TableThickness(Float place) { return 0.025 * place * exp(0.25 * place) * ExpRatio(0.25 * place); }

// Weight of node -1, 0, 1 or 2 for interpolation at the fraction f from node 0 to node 1 (Catmull and Rom 1974).
TERM Float CubicWeight(int node, Float f) {
  if (node < 0) return 0.5 * f * (f * (2.0 - f) - 1.0);
  if (node == 0) return 0.5 * (f * f * (3.0 * f - 5.0) + 2.0);
  if (node == 1) return 0.5 * f * (f * (4.0 - 3.0 * f) + 1.0);
  return 0.5 * f * f * (f - 1.0);
}

// Exit radiance per radiant exitance of the diffusing layer, per steradian: (1 - F) / (pi (1 - Fdr)), F the reflectance
// towards the viewer. Without the normalisation by the diffuse Fresnel reflectance Fdr (from outside), 11 % of the
// light of a tooth is lost.
TERM Float ExitLobe(Float reflectance, Float diffuse_fresnel_outside) {
  return (1.0 - reflectance) / (TERM_PI * (1.0 - diffuse_fresnel_outside));
}

// Dipole (Jensen et al. 2001): reflectance per mm^2 at distance r of a half space lit at a point; depth 1/st' of the source,
// zb = 2 A D.
TERM Float DipoleProfile(Float reduced_albedo, Float depth_mm, Float transport, Float zb, Float r_mm) {
  Float image = depth_mm + 2.0 * zb;
  Float d = sqrt(r_mm * r_mm + depth_mm * depth_mm);
  Float e = sqrt(r_mm * r_mm + image * image);
  return reduced_albedo / (4.0 * TERM_PI) *
         (depth_mm * (1.0 + transport * d) * exp(-transport * d) / (d * d * d) +
          image * (1.0 + transport * e) * exp(-transport * e) / (e * e * e));
}

// Its integral over the plane.
TERM Float DipoleReflectance(Float reduced_albedo, Float depth_mm, Float transport, Float zb) {
  return 0.5 * reduced_albedo * exp(-transport * depth_mm) * (1.0 + exp(-2.0 * transport * zb));
}

// Multipole (Donner and Jensen 2005) with the infinite sum of images in closed form. `transport` may be
// sqrt(transport^2 + q^2): then this is the profile's two-dimensional Fourier transform at spatial frequency q
// (rad/mm), and q = 0 gives the total. The point source must lie in the slab, depth < thickness, which excludes clear
// or thin layers.
TERM Float MultipoleReflectance(Float reduced_albedo, Float depth_mm, Float transport, Float thickness_mm, Float zb_front,
                                Float zb_back) {
  Float k = transport;
  Float beyond = thickness_mm + zb_back - depth_mm;
  Float length = thickness_mm + zb_front + zb_back;
  return reduced_albedo * 0.5 * exp(-k * depth_mm) * (1.0 + exp(-2.0 * k * zb_front)) * (beyond / length) *
         ExpRatio(2.0 * k * beyond) / ExpRatio(2.0 * k * length);
}

TERM Float MultipoleTransmittance(Float reduced_albedo, Float depth_mm, Float transport, Float thickness_mm, Float zb_front,
                                  Float zb_back) {
  Float k = transport;
  Float before = depth_mm + zb_front;
  Float length = thickness_mm + zb_front + zb_back;
  return reduced_albedo * 0.5 * exp(-k * (thickness_mm - depth_mm)) * (1.0 + exp(-2.0 * k * zb_back)) * (before / length) *
         ExpRatio(2.0 * k * before) / ExpRatio(2.0 * k * length);
}

// Normalised diffusion (Christensen and Burley 2015): reflectance per mm^2 that integrates to `albedo`, free path in
// mm. For comparison only: it models neither the boundary nor layers. Shape for light at normal incidence, length 1/st.
TERM Float NormalisedDiffusionShape(Float albedo) {
  Float x = abs(albedo - 0.8);
  return 1.85 - albedo + 7.0 * x * x * x;
}
TERM Float NormalisedDiffusionProfile(Float albedo, Float free_path_mm, Float r_mm) {
  Float s = NormalisedDiffusionShape(albedo) / free_path_mm;
  return albedo * s / (8.0 * TERM_PI * max(r_mm, Float(1e-9))) * (exp(-s * r_mm) + exp(-s * r_mm / 3.0));
}
// Fraction of it within r.
TERM Float NormalisedDiffusionWithin(Float albedo, Float free_path_mm, Float r_mm) {
  Float x = NormalisedDiffusionShape(albedo) / free_path_mm * r_mm;
  return 0.25 * x * (ExpRatio(x) + ExpRatio(x / 3.0));  // 1 - e^-x / 4 - 3 e^-x/3 / 4 without cancellation
}

// Offsets of the 1 + 12 taps of Hable's blur ("Fast Skin Shading", ShaderX7 2009), in units of the kernel's scale,
// inner ones first: the centre, 3 near it, 3 around 1.5, 6 around 5.5. Its weights fit skin and are not used.
TERM Float HableTapX(int tap) {
  if (tap == 1) return Float(-0.194906);
  if (tap == 2) return Float(-0.239737);
  if (tap == 3) return Float(-0.003530);
  if (tap == 4) return Float(1.633992);
  if (tap == 5) return Float(0.177801);
  if (tap == 6) return Float(1.320107);
  if (tap == 7) return Float(5.970690);
  if (tap == 8) return Float(-1.089250);
  if (tap == 9) return Float(-4.015465);
  if (tap == 10) return Float(-4.063099);
  if (tap == 11) return Float(-0.638605);
  if (tap == 12) return Float(2.542348);
  return Float(0.0);
}
TERM Float HableTapY(int tap) {
  if (tap == 1) return Float(0.091094);
  if (tap == 2) return Float(-0.220217);
  if (tap == 3) return Float(-0.118219);
  if (tap == 4) return Float(0.036795);
  if (tap == 5) return Float(1.717592);
  if (tap == 6) return Float(-0.181542);
  if (tap == 7) return Float(0.253378);
  if (tap == 8) return Float(4.958349);
  if (tap == 9) return Float(4.156699);
  if (tap == 10) return Float(-4.110150);
  if (tap == 11) return Float(-6.297663);
  if (tap == 12) return Float(-3.245901);
  return Float(0.0);
}
