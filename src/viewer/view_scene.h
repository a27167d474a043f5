#pragma once
// The content of the viewer's window: the crown, its light, a photograph and the difference. A background thread
// prepares them.

#include <map>
#include <memory>
#include <optional>
#include <string>

#include "base/background.h"
#include "viewer/crown_renderer.h"
#include "viewer/scene_difference.h"
#include "viewer/thickness_view.h"

namespace crownfit {

/// The desired content of the screen.
struct SceneWish {
  size_t photograph = 0;
  glm::dmat3 light_turn{1.0};
  bool is_turning = false;           ///< coarse light is sufficient
  bool photograph_is_shown = false;  ///< its picture is required
  bool difference_is_shown = false;  ///< and camera and lamps are as in the photograph
  bool material_rests = true;        ///< no slider is held
  ShownTerms terms;
};

class ViewScene {
 public:
  /// Builds the crown. Needs a current context. `capture`: with the current exposures and intensities.
  ViewScene(Capture capture, const Material& material, CrownInput input, std::shared_ptr<const Crown> crown,
            int threads);

  /// Takes finished work and starts missing work. True when something visible has changed.
  bool Update(const SceneWish& wish);
  void SetMaterial(const Material& material);

  const Capture& capture() const { return capture_; }
  const Crown& crown() const { return *crown_; }
  glm::dvec3 middle() const;
  CrownRenderer& renderer() { return *renderer_; }
  ThicknessView& thickness_view() { return *thickness_view_; }
  double outer_thickness_scale() const;

  bool HasLightOf(size_t photograph) const { return light_ && light_->photograph == photograph; }
  /// The photograph, once it is read; or the error message.
  std::shared_ptr<const Photograph> picture(size_t photograph) const;
  std::string picture_error(size_t photograph) const;
  const SceneDifference* difference(size_t photograph) const;
  double exposure(size_t photograph) const;
  /// Factor on linear values for display, at 0 stops.
  double brightness(size_t photograph) const;

  bool IsBusy() const { return work_.IsBusy(); }
  bool IsCastingLight() const;  ///< coarsely, for lamps that turn
  const std::string& busy_with() const { return work_.what(); }
  std::string TakeError();
  int version() const { return version_; }  ///< of the drawn crown, light and material

 private:
  struct LightKey {
    size_t photograph;
    glm::dmat3 turn;
    bool operator==(const LightKey&) const = default;
  };
  std::vector<double> ThicknessToBuild() const;
  bool StartWhatIsMissing(const SceneWish& wish);
  void StartRebuild(const SceneWish& wish);
  void StartLight(const SceneWish& wish, bool fine);
  void StartReading(size_t photograph);
  void StartMask(size_t photograph);
  void StartComparison(const SceneWish& wish);
  void KeepTime(double coarse_cast_s);
  void TakeLight(const Capture& turned, const LightKey& key, const VertexCast& cast, bool fine);
  void TakeCrown(std::shared_ptr<const Crown> crown);
  void ShowAsBrightAsPhotograph();
  Image DrawPhotograph(size_t photograph, const ShownTerms& terms);

  Capture capture_;
  Material material_;
  CrownInput input_;
  int threads_;
  std::shared_ptr<const Crown> crown_;
  std::vector<double> built_mm_, cast_mm_;
  std::unique_ptr<CrownRenderer> renderer_;
  std::unique_ptr<ThicknessView> thickness_view_;
  Background work_;

  std::optional<LightKey> light_, refused_light_;
  bool light_is_fine_ = false;
  size_t coarseness_ = 1;  ///< of the light while lamps are dragged
  std::vector<double> refused_mm_;
  std::map<size_t, double> brightness_;
  std::shared_ptr<const Photograph> picture_;
  size_t picture_of_ = 0;
  std::map<size_t, std::string> picture_errors_;
  std::shared_ptr<const std::vector<uint8_t>> mask_;
  size_t mask_of_ = 0;
  std::optional<SceneDifference> difference_;
  int version_ = 0, compared_version_ = -1;
  ShownTerms compared_terms_;
  std::string error_;
};

}  // namespace crownfit
