#pragma once
// A plate of two layers that tests of paths see under a lamp.

#include "geometry/mesh_file.h"
#include "support/shapes.h"
#include "support/temporary_folder.h"
#include "support/walked.h"

namespace crownfit {

/// A plate of two layers under a wide lamp, which walks that leave meet often.
inline KnownScene Plate(double roughness = 0.2, double g = 0.6) {
  KnownScene scene(Box({-2, -2, -1}, {2, 2, 0}), 2, 0.3, 6, 3.6);
  SetLayer(scene, 0, 1.62, g, 0.5, 0.02);
  SetLayer(scene, 1, 1.54, g, 1.0, 0.1);
  SetSurface(scene, roughness, 0.0);
  scene.Light(DiskLight{{150, 0, 150}, glm::normalize(glm::dvec3(-1, 0, -1)), glm::dvec3(2.0), 0.0, 200.0});
  return scene;
}

/// Its outer layer absorbs five times as much on average, and more towards +x.
inline KnownScene PlateWithTexture() {
  KnownScene plate = Plate();
  TriangleMesh mesh = Refined(*plate.source.meshes[0], 0.5);
  for (const auto& v : mesh.vertices) mesh.vertex_properties["stain"].push_back(5.0 + v.x);
  const TemporaryFolder folder;
  WritePly(folder.path / "plate.ply", mesh);
  plate.capture.layers[0].absorption_texture = {{}, {"stain"}, 0, 1};
  plate.source.absorption[0] = std::make_shared<AbsorptionTexture>(plate.capture, 0, folder.path / "plate.ply", 0);
  return plate;
}

}  // namespace crownfit
