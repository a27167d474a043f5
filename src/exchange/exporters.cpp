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
      WriteCsv, "a table (CSV)",
      "`material.csv`: one row for a value, with unit, standard deviation, 95 % interval and status as the fit states "
      "them. Rows of status `derived` follow from the others by the formulas below; they carry no interval.\n",
      "| `scattering_per_mm` | ss = ss' / (1 - (1 - i) g) |\n"
      "| `mean_free_path_mm` | 1 / (ss + sa) |\n"
      "| `single_scattering_albedo` | ss / (ss + sa) |\n"
      "| `multiple_scattering_albedo` | (1 - s)(1 - 0.139 s) / (1 + 1.17 s), s = sqrt(sa / (sa + ss')) (van de Hulst "
      "1980) |\n"
      "| `diffuse_mean_free_path_mm` | 1 / sqrt(3 sa (sa + ss')) |\n",
      "- Correlations between values. Shape, lamps, cameras.\n"};
}

Exporter MaterialX() {
  return {
      WriteMaterialX, "MaterialX (OpenPBR)",
      "`material.mtlx` holds `all_layers`, one medium in place of the layers, and `layer_NAME` for every layer by "
      "itself. Lengths are millimetres: scale `subsurface_radius` when your scene's unit is another.\n",
      "| scattering ss, absorption sa | `subsurface_radius` x `subsurface_radius_scale` = 1 / (ss + sa), mm |\n"
      "| albedo of multiple scattering | `subsurface_color` = (1 - s)(1 - 0.139 s) / (1 + 1.17 s), s = sqrt(sa / (sa + "
      "ss')) (van de Hulst 1980) |\n"
      "| g, isotropic fraction i | `subsurface_scatter_anisotropy` = (1 - i) g |\n"
      "| `roughness` (GGX alpha) | `specular_roughness` = sqrt(alpha) |\n"
      "| `ior` | `specular_ior`, over the index outside |\n",
      "- Layers: `all_layers` returns the same light at normal incidence as the layers do, but it spreads and passes "
      "it otherwise: up to three times as much blue. Not for light from behind.\n- Thickness: light leaves where the "
      "mesh ends. Shape, lamps, cameras. Intervals.\n"};
}

Exporter Mitsuba() {
  return {
      WriteMitsuba,
      "Mitsuba 3",
      "`material.xml` holds a medium and a boundary for every layer. With a capture every photograph is a scene:\n\n"
      "    mitsuba -m scalar_rgb PHOTOGRAPH.xml -o PHOTOGRAPH.exr -Dspp=1024\n\n"
      "Use an RGB variant: colours stand for the camera's channels. `-Dintegrator=volpath` is faster where all "
      "channels "
      "scatter alike. The picture is the photograph: radiances of lamps are multiplied by pi x exposure_scale.\n",
      "",
      "- Light that meets a rough surface's facets more than once: Mitsuba's `roughdielectric` drops it, and a path "
      "crosses the surface about six times (how much: docs/exchange.md, Mitsuba).\n"
      "- A layer that stands out of the one around it (a root) is given the index step to the layer, not to air.\n"
      "- Environment maps are read between pixels, not pixel by pixel. Intervals.\n",
      "Measured with Mitsuba 3.9.1, smooth surfaces: whole pictures within 0.7 %, blocks of 6 x 6 pixels within 4 "
      "standard errors. Rough surfaces come out darker, by 26 % at roughness 0.3."};
}

Exporter Pbrt() {
  return {
      WritePbrt,
      "pbrt-v4",
      "`material.pbrt` holds a medium and a boundary for every layer. With a capture every photograph is a scene:\n\n"
      "    pbrt PHOTOGRAPH.pbrt\n\n"
      "The picture is the photograph: radiances of lamps are multiplied by pi x exposure_scale.\n",
      "",
      "- Channels: pbrt renders spectra and makes smooth ones of R, G, B, so what it shows in a channel is not what "
      "the "
      "coefficients of that channel give alone. For numbers, render three grey scenes.\n"
      "- `isotropic_fraction`: pbrt scatters by Henyey and Greenstein with (1 - i) g.\n"
      "- Light that meets a rough surface's facets more than once is dropped.\n"
      "- Lamps block light and are seen; environment maps are left out (pbrt wants squares of equal area).\n"
      "- An opaque neck is seen from outside too. Intervals.\n",
      "Unknown: no picture of pbrt was compared. The media and boundaries are those of the Mitsuba export."};
}

Exporter Gltf() {
  return {
      WriteGltf,
      "glTF 2.0",
      "`crown.glb`: the outer surface with normals (metres), the photographs' cameras, and a material that looks like "
      "the crown in viewers that draw surfaces. Without a capture it holds the material alone.\n",
      "| layers | reflectance R and transmittance T of a flat sample of them at normal incidence, by adding-doubling "
      "|\n"
      "| R, T | (1 - f) `baseColorFactor` = R / (1 - F0), f `diffuseTransmissionColorFactor` = T0 / (1 - F0), T0 "
      "without absorption |\n"
      "| absorption | `attenuationColor` = T / T0 at `attenuationDistance` = the thickness, m |\n"
      "| `roughness` (GGX alpha) | `roughnessFactor` = sqrt(alpha) |\n"
      "| `ior` | KHR_materials_ior, over the index outside |\n",
      "- Light that leaves elsewhere than it entered: no lateral spread. Layers, g, intervals.\n"
      "- Thickness as it varies: one mean for all of the crown. Without known thicknesses nothing shines through.\n"
      "- Lamps, tiles, scenery; a principal point off the picture's centre.\n",
      "None can be promised: a surface has no depth. A flat sample under even light has the stated colour; a curved "
      "crown by one lamp was off by CIEDE2000 17 to 31 at the terminator with every flat model that was tried."};
}

Exporter Iad() {
  return {WriteRxt, "iad (inverse adding-doubling)",
          "`material.rxt`: total reflectance and transmittance of flat samples with smooth surfaces, for each channel "
          "at the "
          "material's thickness, where it states one, and at 0.5, 1, 1.5 and 2 mm; by adding-doubling.\n",
          "| layers | R (what the first surface mirrors included) and T for a beam along the normal, in air |\n"
          "| g, isotropic fraction i | (1 - i) g, of the outermost layer |\n",
          "- Layers: iad knows of one slab of one index, so what it finds from several layers is no property of any.\n"
          "- Roughness, shape, lamps, cameras, intervals.\n"};
}

Exporter Blender() {
  return {
      WriteBlender,
      "Blender (Cycles)",
      "`crown.py` builds the material and, with a capture, the scene of a photograph:\n\n"
      "    blender --background --python crown.py -- PHOTOGRAPH            # one medium: Principled BSDF, subsurface\n"
      "    blender --background --python crown.py -- PHOTOGRAPH --layers   # every layer a Principled Volume: slow\n\n"
      "It saves `crown.blend`. The picture is the photograph: radiances of lamps are multiplied by pi x "
      "exposure_scale. "
      "Written for Blender 4.2 and later.\n",
      "| layers, without `--layers` | one medium that scatters evenly: `Subsurface Radius` = 1 / (ss' + sa), mm; `Base "
      "Color` = "
      "what a half space of it returns from behind its surface at normal incidence, over 1 - F0, by adding-doubling |\n"
      "| layers, with `--layers` | `Density` d, `Color` = ss / d, `Absorption Color` = (1 - sa / (d - ss))^2 |\n"
      "| `roughness` (GGX alpha) | `Roughness` = sqrt(alpha) |\n",
      "- Without `--layers`: layers, and an index step from inside (the walk in the medium leaves as if there were "
      "none).\n"
      "- With `--layers`: the isotropic fraction (Henyey and Greenstein with (1 - i) g), and Cycles' limit of 1024 "
      "bounces; a root outside its layer.\n"
      "- What an opaque neck returns. Intervals.\n",
      "Measured with Blender 5.0.1, whole pictures. With `--layers`: within 2 % on smooth surfaces, 5 % on rough "
      "ones. Without: 1 to 3 % on thick pieces lit from the front, too dark by up to a half where they are thin or "
      "lit from behind."};
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
