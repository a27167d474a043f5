#include "viewer/view_scene.h"

#include <algorithm>
#include <chrono>
#include <iterator>

#include "base/error.h"
#include "scene/build_crown.h"
#include "scene/cast_capture.h"
#include "scene/cast_photograph.h"
#include "viewer/view_pose.h"

namespace crownfit {
namespace {

using Clock = std::chrono::steady_clock;

/// Numbers of sampled directions while lamps are dragged, towards lamps and towards scenery: as many as time allows.
struct CoarseStrata {
  int lamps, gather;
};
constexpr CoarseStrata kCoarse[] = {{3, 4}, {2, 2}, {1, 2}};
constexpr size_t kCoarsest = std::size(kCoarse) - 1;
constexpr double kSlowCast_s = 0.08, kQuickCast_s = 0.03;
constexpr ShownTerms kCrownAlone{.scenery = false};
const char *const kCasting = "casting light", *const kRefining = "refining the light";

CastOptions CoarseOptions(size_t coarseness, int threads) {
  CastOptions options;
  options.threads = threads;
  options.strata = kCoarse[coarseness].lamps;
  options.gather_strata = kCoarse[coarseness].gather;
  options.shade_scenery = true;
  return options;
}

}  // namespace

ViewScene::ViewScene(Capture capture, const Material& material, CrownInput input, std::shared_ptr<const Crown> crown,
                     int threads)
    : capture_(std::move(capture)), material_(material), input_(std::move(input)), threads_(threads) {
  built_mm_ = ThicknessesOf(capture_, material_);
  TakeCrown(std::move(crown));
}

glm::dvec3 ViewScene::middle() const {
  const auto [low, high] = Bounds(crown_->fine);
  return 0.5 * (low + high);
}

double ViewScene::outer_thickness_scale() const {
  return SlotValues(capture_, material_, CastState{crown_, cast_mm_, {}}, 0)[2];
}

std::shared_ptr<const Photograph> ViewScene::picture(size_t photograph) const {
  return picture_of_ == photograph ? picture_ : nullptr;
}

std::string ViewScene::picture_error(size_t photograph) const {
  const auto found = picture_errors_.find(photograph);
  return found == picture_errors_.end() ? "" : found->second;
}

const SceneDifference* ViewScene::difference(size_t photograph) const {
  return difference_ && picture_of_ == photograph ? &*difference_ : nullptr;
}

double ViewScene::exposure(size_t photograph) const {
  const SceneDifference* found = difference(photograph);
  return found ? found->exposure : capture_.photographs[photograph].exposure_scale;
}

double ViewScene::brightness(size_t photograph) const {
  const auto found = brightness_.find(photograph);
  return found == brightness_.end() ? 1.0 : found->second;
}

bool ViewScene::IsCastingLight() const { return work_.IsBusy() && work_.what() == kCasting; }

std::string ViewScene::TakeError() {
  std::string error;
  error.swap(error_);
  return error;
}

void ViewScene::SetMaterial(const Material& material) {
  material_ = material;
  renderer_->SetMaterial(capture_, material_, cast_mm_);
  ++version_;
}

void ViewScene::TakeCrown(std::shared_ptr<const Crown> crown) {
  crown_ = std::move(crown);
  cast_mm_ = CastThicknesses(capture_, *crown_, built_mm_);
  renderer_ = std::make_unique<CrownRenderer>(crown_, ShownChannelsOf(capture_));
  thickness_view_ = std::make_unique<ThicknessView>(crown_);
  light_.reset();
  mask_.reset();
  SetMaterial(material_);
}

/// Thicknesses of the layers that have an offset below; other thicknesses only scale lengths.
std::vector<double> ViewScene::ThicknessToBuild() const {
  std::vector<double> wanted = ThicknessesOf(capture_, material_);
  for (size_t i = 0; i < wanted.size(); ++i)
    if (i + 1 == wanted.size() || capture_.layers[i + 1].surface) wanted[i] = built_mm_[i];
  return wanted;
}

bool ViewScene::Update(const SceneWish& wish) {
  bool changed = false;
  try {
    changed = work_.Poll();
  } catch (const InputError& e) {
    error_ = e.what();
    changed = true;
  }
  try {
    if (StartWhatIsMissing(wish)) changed = true;
  } catch (const InputError& e) {
    error_ = e.what();
    changed = true;
  }
  return changed;
}

bool ViewScene::StartWhatIsMissing(const SceneWish& wish) {
  const LightKey key{wish.photograph, wish.light_turn};
  const bool needs_light = light_ != key && refused_light_ != key;
  const bool may_start = !work_.IsBusy() || (work_.what() == kRefining && needs_light);
  if (!may_start) return false;
  const bool is_stale = ThicknessToBuild() != built_mm_ && ThicknessToBuild() != refused_mm_;
  const bool lacks_picture =
      !picture(wish.photograph) && !picture_errors_.contains(wish.photograph) && wish.photograph_is_shown;
  const bool is_compared = compared_version_ == version_ && compared_terms_ == wish.terms;
  if (is_stale && wish.material_rests) {
    StartRebuild(wish);
  } else if (needs_light) {
    StartLight(wish, /*fine=*/false);
  } else if (lacks_picture) {
    StartReading(wish.photograph);
  } else if (light_ == key && !light_is_fine_ && !wish.is_turning) {
    StartLight(wish, /*fine=*/true);
  } else if (wish.difference_is_shown && picture(wish.photograph) && light_ == key && !is_compared &&
             wish.material_rests) {
    if (mask_ && mask_of_ == wish.photograph) {
      StartComparison(wish);
    } else {
      StartMask(wish.photograph);
    }
  } else {
    return false;
  }
  return true;
}

void ViewScene::StartRebuild(const SceneWish& wish) {
  const std::vector<double> wanted = ThicknessToBuild();
  refused_mm_ = wanted;  // until it is built
  const LightKey key{wish.photograph, wish.light_turn};
  const CastOptions coarse = CoarseOptions(coarseness_, threads_);
  work_.Start("building the layers", [this, wanted, key, coarse, middle = middle()]() -> Background::Finish {
    auto crown = BuildCrown(capture_, input_.source, wanted, threads_);
    auto turned = WithLampsTurned(capture_, key.photograph, middle, key.turn);
    auto cast = CastVertices(turned, *crown, input_.scenery, key.photograph, coarse);
    return [this, wanted, key, crown = std::move(crown), turned = std::move(turned), cast = std::move(cast)] {
      built_mm_ = wanted;
      refused_mm_.clear();
      TakeCrown(crown);
      TakeLight(turned, key, cast, false);
    };
  });
}

void ViewScene::StartLight(const SceneWish& wish, bool fine) {
  const LightKey key{wish.photograph, wish.light_turn};
  if (!fine) refused_light_ = key;  // until it is cast
  CastOptions options = CoarseOptions(coarseness_, threads_);
  if (fine) options = {.shade_scenery = true, .threads = threads_};
  work_.Start(fine ? kRefining : kCasting,
              [this, key, fine, options, crown = crown_, middle = middle()]() -> Background::Finish {
                const auto begin = Clock::now();
                auto turned = WithLampsTurned(capture_, key.photograph, middle, key.turn);
                auto cast = CastVertices(turned, *crown, input_.scenery, key.photograph, options);
                const double seconds = std::chrono::duration<double>(Clock::now() - begin).count();
                return [this, key, fine, seconds, turned = std::move(turned), cast = std::move(cast)] {
                  if (!fine) KeepTime(seconds);
                  TakeLight(turned, key, cast, fine);
                };
              });
}

void ViewScene::KeepTime(double coarse_cast_s) {
  if (coarse_cast_s > kSlowCast_s && coarseness_ < kCoarsest) ++coarseness_;
  if (coarse_cast_s < kQuickCast_s && coarseness_ > 0) --coarseness_;
}

void ViewScene::TakeLight(const Capture& turned, const LightKey& key, const VertexCast& cast, bool fine) {
  light_.reset();  // if the renderer throws, its old light must not be shown as the new one
  ++version_;
  renderer_->SetLight(turned, key.photograph, cast);
  light_ = key;
  refused_light_.reset();
  light_is_fine_ = fine;
  if (brightness_.contains(key.photograph)) return;
  const Image picture = DrawPhotograph(key.photograph, kCrownAlone);
  const PhotographSpec& photo = capture_.photographs[key.photograph];
  brightness_[key.photograph] =
      ComparisonScale(picture, LitPixels(picture), photo.rgb_from_sensor) / photo.exposure_scale;
}

Image ViewScene::DrawPhotograph(size_t photograph, const ShownTerms& terms) {
  const PhotographSpec& photo = capture_.photographs[photograph];
  const Canvas canvas(photo.camera.width, photo.camera.height);
  renderer_->Draw(photo, terms, canvas, Quality::kStill);
  return canvas.Read();
}

void ViewScene::StartReading(size_t photograph) {
  picture_errors_[photograph] = "";  // until it is read
  work_.Start("reading the photograph", [this, photograph]() -> Background::Finish {
    const PhotographSpec& spec = capture_.photographs[photograph];
    std::shared_ptr<const Photograph> read;
    std::string error;
    try {
      read = std::make_shared<const Photograph>(InShownChannels(ReadPhotograph(spec.files), ShownChannelsOf(capture_)));
      if (read->linear.width != spec.camera.width || read->linear.height != spec.camera.height)
        error = spec.files.image.string() + ": does not have the size of its camera file";
    } catch (const InputError& e) {
      error = e.what();
    }
    return [this, photograph, read, error] {
      picture_errors_.erase(photograph);
      if (!error.empty()) picture_errors_[photograph] = error;
      picture_ = error.empty() ? read : nullptr;
      picture_of_ = photograph;
      difference_.reset();
      compared_version_ = -1;
      ShowAsBrightAsPhotograph();
    };
  });
}

/// The brightness scale of the difference: from the photograph's pixels on the crown.
void ViewScene::ShowAsBrightAsPhotograph() {
  if (!picture_ || !HasLightOf(picture_of_)) return;
  std::vector<uint8_t> mask = LitPixels(DrawPhotograph(picture_of_, kCrownAlone));
  for (size_t i = 0; i < mask.size(); ++i) mask[i] = mask[i] && picture_->usable[i];
  brightness_[picture_of_] = ComparisonScale(picture_->linear, mask, capture_.photographs[picture_of_].rgb_from_sensor);
}

void ViewScene::StartMask(size_t photograph) {
  work_.Start("finding the pixels to compare",
              [this, photograph, crown = crown_, picture = picture_]() -> Background::Finish {
                auto mask = std::make_shared<const std::vector<uint8_t>>(
                    PixelsToCompare(input_, capture_, *crown, *picture, photograph, threads_));
                return [this, photograph, mask] {
                  mask_ = mask;
                  mask_of_ = photograph;
                };
              });
}

void ViewScene::StartComparison(const SceneWish& wish) {
  compared_version_ = version_;  // also if the renderer throws: it would throw again
  compared_terms_ = wish.terms;
  work_.Start("comparing",
              [this, spec = capture_.photographs[wish.photograph], picture = picture_, mask = mask_,
               prediction = DrawPhotograph(wish.photograph, wish.terms)]() -> Background::Finish {
                auto found = Compare(spec, *picture, prediction, *mask);
                return [this, found = std::move(found)] {
                  const int number = difference_ ? difference_->number + 1 : 0;
                  difference_ = found;
                  difference_->number = number;
                };
              });
}

}  // namespace crownfit
