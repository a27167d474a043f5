#pragma once
// A photograph's lamps on the graphics processor, as shaders/viewer/lamps.glsl reflects them. Small lamps are sampled
// point by point. Light from all around comes from tables: the average over a lobe about the mirrored direction, times
// the surface's reflection of a uniform sky (Karis 2013's split sum, exact for a uniform sky). A film of water mirrors
// it.

#include <array>
#include <vector>

#include "capture/light_rig.h"
#include "shader/shader_model.h"
#include "viewer/gl.h"

namespace crownfit {

class Lamps {
 public:
  static constexpr size_t kMost = 8;

  /// In the object's frame; at most kMost. `middle`: of the crown; point lamps become disks that face it.
  void SetLamps(std::vector<LightShape> shapes, const glm::dvec3& middle, const ShownChannels& shown);
  void SetSurface(const ShaderOptics<double>& optics);
  /// Sets the uniforms of a program with lamps.glsl; call after Use.
  void SetUniforms(Program& program) const;
  size_t count() const { return shapes_.size(); }

 private:
  ShownChannels shown_{0, 1, 2};
  void UploadPoints(const glm::dvec3& middle);
  void UploadMirrors();
  void UploadReflectedSky();
  void UploadEnvironments();

  std::vector<LightShape> shapes_;
  std::vector<int> first_point_;        ///< per lamp + 1
  std::vector<int> first_environment_;  ///< per lamp; -1: not an environment
  ShaderOptics<double> optics_;
  bool has_surface_ = false;
  double reflected_sky_ = 0;  ///< of a uniform sky of radiance 1 by the rough surface, seen along its normal
  Buffer points_, mirrors_, reflected_skies_, environments_;
};

}  // namespace crownfit
