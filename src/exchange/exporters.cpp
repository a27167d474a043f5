#include "exchange/exporters.h"

namespace crownfit {
namespace {

const char* const kSceneTable =
    "| `reduced_scattering_per_mm`, `g`, `isotropic_fraction` | scattering ss = ss' / (1 - (1 - i) g), 1/mm |\n"
    "| `absorption_per_mm` | absorption sa, 1/mm |\n"
    "| `ior` | dielectric boundaries between the indices on their two sides |\n"
    "| `roughness` | GGX alpha of the outermost boundary; the inner ones are smooth |\n";

Exporter Csv() {
  return {
      WriteCsv,
      "a table (CSV)",
      "`material.csv`: one row per value, with unit, standard deviation, 95 % interval and status as the fit states "
      "them. Rows of status `derived` follow from the others by the formulas below and have no interval.\n",
      "| `scattering_per_mm` | ss = ss' / (1 - (1 - i) g) |\n"
      "| `mean_free_path_mm` | 1 / (ss + sa) |\n"
      "| `single_scattering_albedo` | ss / (ss + sa) |\n"
      "| `multiple_scattering_albedo` | (1 - s)(1 - 0.139 s) / (1 + 1.17 s), s = sqrt(sa / (sa + ss')) (van de Hulst "
      "1980) |\n"
      "| `diffuse_mean_free_path_mm` | 1 / sqrt(3 sa (sa + ss')) |\n",
      "- Correlations between values. Shape, lamps, cameras.\n",
      "",
      true};
}

Exporter MaterialX() {
  return {
      WriteMaterialX, "MaterialX (OpenPBR)",
      "`material.mtlx` holds `all_layers`, one medium instead of the layers, and `layer_NAME` for every layer by "
      "itself. Lengths are millimetres: scale `subsurface_radius` if your scene has another unit.\n",
      "| scattering ss, absorption sa | `subsurface_radius` x `subsurface_radius_scale` = 1 / (ss + sa), mm |\n"
      "| albedo of multiple scattering | `subsurface_color` = (1 - s)(1 - 0.139 s) / (1 + 1.17 s), s = sqrt(sa / (sa + "
      "ss')) (van de Hulst 1980) |\n"
      "| g, isotropic fraction i | `subsurface_scatter_anisotropy` = (1 - i) g |\n"
      "| `roughness` (GGX alpha) | `specular_roughness` = sqrt(alpha) |\n"
      "| `ior` | `specular_ior`, over the index outside |\n",
      "- Layers: `all_layers` has the layers' reflectance at normal incidence, but another spread and transmittance "
      "(up to three times as much blue). Do not use it for light from behind.\n"
      "- Thickness: light leaves where the mesh ends. Shape, lamps, cameras. Intervals.\n"};
}

Exporter Mitsuba() {
  return {
      WriteMitsuba,
      "Mitsuba 3",
      "`material.xml` holds a medium and a boundary for every layer. With a capture every photograph is a scene:\n\n"
      "    mitsuba -m scalar_rgb PHOTOGRAPH.xml -o PHOTOGRAPH.exr -Dspp=1024\n\n"
      "Use an RGB variant: three channels are written as colours. Other numbers of channels are written as spectra "
      "over "
      "their wavelengths, for `scalar_spectral`, and the film has a narrow band for each. `-Dintegrator=volpath` is "
      "faster if all channels "
      "scatter alike. The picture has the pixel values of the photograph: radiances of lamps are multiplied by pi x "
      "exposure_scale. Where the surface is rough it is darker, see below.\n",
      "",
      "- Light that a rough surface scatters more than once between its microfacets: Mitsuba's `roughdielectric` drops "
      "it, and a path crosses the surface about six times. Pictures have 0.94 to 0.97 of their light at roughness 0.1, "
      "0.83 to 0.90 at 0.2, 0.72 to 0.82 at 0.3, 0.62 to 0.74 at 0.4; bright channels lose most.\n"
      "- A layer that reaches outside of the layer around it (a root) gets the index step to that layer, not to air.\n"
      "- Environment maps are interpolated between pixels, not read pixel by pixel. Intervals.\n",
      "Measured with Mitsuba 3.9.1 on smooth surfaces: whole pictures within 0.7 %, blocks of 6 x 6 pixels within 4 "
      "standard errors. The losses of rough surfaces were measured on two bundled captures.",
      true};
}

Exporter Pbrt() {
  return {
      WritePbrt,
      "pbrt-v4",
      "`material.pbrt` holds a medium and a boundary for every layer. With a capture every photograph is a scene:\n\n"
      "    pbrt PHOTOGRAPH.pbrt\n\n"
      "The picture has the pixel values of the photograph: radiances of lamps are multiplied by pi x exposure_scale.\n",
      "",
      "- Channels: pbrt renders smooth spectra that it makes from R, G, B. A channel of its picture therefore mixes "
      "the coefficients of all channels. For numbers, render three grey scenes.\n"
      "- `isotropic_fraction`: pbrt scatters by Henyey and Greenstein with (1 - i) g.\n"
      "- Light that a rough surface scatters more than once between its microfacets is dropped, as by Mitsuba: its "
      "pictures have 0.94 to 0.97 of their light at roughness 0.1, 0.72 to 0.82 at 0.3.\n"
      "- Lamps block light and are visible. Environment maps are left out (pbrt needs squares of equal area).\n"
      "- An opaque neck is visible from outside too. Intervals.\n",
      "Unknown: no picture of pbrt was compared. The media and boundaries are those of the Mitsuba export."};
}

Exporter Gltf() {
  return {
      WriteGltf,
      "glTF 2.0",
      "`crown.glb`: the outer surface with normals (metres), the photographs' cameras, and a material that looks like "
      "the crown in viewers that draw surfaces. Without a capture it holds only the material.\n",
      "| layers | reflectance R and transmittance T of a flat sample of them at normal incidence, by adding-doubling "
      "|\n"
      "| R, T | (1 - f) `baseColorFactor` = R / (1 - F0), f `diffuseTransmissionColorFactor` = T0 / (1 - F0), T0 "
      "without absorption |\n"
      "| absorption | `attenuationColor` = T / T0 at `attenuationDistance` = the thickness, m |\n"
      "| `roughness` (GGX alpha) | `roughnessFactor` = sqrt(alpha) |\n"
      "| `ior` | KHR_materials_ior, over the index outside |\n",
      "- Lateral spread: light leaves where it entered. Layers, g, intervals.\n"
      "- Varying thickness: the whole crown has one mean thickness. If thicknesses are unknown, no light is "
      "transmitted.\n"
      "- Lamps, tiles, scenery; a principal point off the picture's centre.\n",
      "None can be promised, because a surface has no depth. A flat sample under even light has the stated colour. A "
      "curved crown under one lamp was off by CIEDE2000 17 to 31 at the terminator with every flat model that was "
      "tried."};
}

Exporter Iad() {
  return {
      WriteRxt,
      "iad (inverse adding-doubling)",
      "`material.rxt`: total reflectance and transmittance of flat samples with smooth surfaces, by adding-doubling. "
      "It has rows for each channel at the material's thickness, if stated, and at 0.5, 1, 1.5 and 2 mm.\n",
      "| layers | R (including the reflection of the first surface) and T for a beam along the normal, in air |\n"
      "| g, isotropic fraction i | (1 - i) g, of the outermost layer |\n",
      "- Layers: iad models one slab of one index. What it finds from several layers is not a property of any of "
      "them.\n"
      "- Roughness, shape, lamps, cameras, intervals.\n",
      "",
      true};
}

Exporter Blender() {
  return {
      WriteBlender,
      "Blender (Cycles)",
      "`crown.py` builds the material and, with a capture, the scene of a photograph:\n\n"
      "    blender --background --python crown.py -- PHOTOGRAPH            # one medium: Principled BSDF, subsurface\n"
      "    blender --background --python crown.py -- PHOTOGRAPH --layers   # every layer a Principled Volume: slow\n\n"
      "It saves `crown.blend`. The picture has the pixel values of the photograph: radiances of lamps are multiplied "
      "by pi x exposure_scale. Written for Blender 4.2 and later.\n",
      "| layers, without `--layers` | one medium that scatters isotropically: `Subsurface Radius` = 1 / (ss' + sa), "
      "mm; `Base Color` = reflectance of a half space of it from behind its surface at normal incidence, over 1 - F0, "
      "by adding-doubling |\n"
      "| layers, with `--layers` | `Density` d, `Color` = ss / d, `Absorption Color` = (1 - sa / (d - ss))^2 |\n"
      "| `roughness` (GGX alpha) | `Roughness` = sqrt(alpha) |\n",
      "- Without `--layers`: the layers, and reflection at the surface from inside.\n"
      "- With `--layers`: the isotropic fraction (Henyey and Greenstein with (1 - i) g), and paths beyond Cycles' "
      "limit of 1024 bounces; a root outside of its layer.\n"
      "- Light that an opaque neck returns. Intervals.\n",
      "Measured with Blender 5.0.1 on whole pictures. With `--layers`: within 2 % on smooth surfaces, 5 % on rough "
      "ones. Without: 1 to 3 % on thick pieces lit from the front; up to half too dark on pieces that are thin or lit "
      "from behind."};
}

}  // namespace

const std::map<std::string, Exporter>& Exporters() {
  static const std::map<std::string, Exporter> exporters = [] {
    std::map<std::string, Exporter> all{{"csv", Csv()},   {"materialx", MaterialX()}, {"mitsuba", Mitsuba()},
                                        {"pbrt", Pbrt()}, {"gltf", Gltf()},           {"blender", Blender()},
                                        {"rxt", Iad()}};
    for (const char* scene : {"mitsuba", "pbrt"}) all[scene].what_is = kSceneTable;
    return all;
  }();
  return exporters;
}

}  // namespace crownfit
