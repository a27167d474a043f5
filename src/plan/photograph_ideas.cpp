#include "plan/photograph_ideas.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/constants.hpp>

namespace crownfit {
namespace {

/// Unit direction from a place towards a lamp; nothing for light from all around.
std::optional<glm::dvec3> Towards(const LightShape& shape, const glm::dvec3& from_mm) {
  struct Direction {
    const glm::dvec3& from_mm;
    using Result = std::optional<glm::dvec3>;
    Result operator()(const DirectionalLight& l) const { return glm::normalize(l.direction); }
    Result operator()(const PointLight& l) const { return glm::normalize(l.position_mm - from_mm); }
    Result operator()(const DiskLight& l) const { return glm::normalize(l.centre_mm - from_mm); }
    Result operator()(const RectangleLight& l) const { return glm::normalize(l.centre_mm - from_mm); }
    Result operator()(const DomeLight&) const { return std::nullopt; }
    Result operator()(const EnvironmentLight&) const { return std::nullopt; }
  };
  return std::visit(Direction{from_mm}, shape);
}

RigidTransform TurnAbout(const glm::dvec3& centre, const glm::dvec3& axis, double angle) {
  const glm::dmat3 turn = RotationFromVector(angle * axis);
  return {turn, centre - turn * centre};
}

/// The turn about `centre` that takes one unit direction to another.
RigidTransform TurnTo(const glm::dvec3& centre, const glm::dvec3& from, const glm::dvec3& to) {
  glm::dvec3 axis = glm::cross(from, to);
  const double sine = glm::length(axis);
  if (sine < 1e-9) axis = glm::cross(from, std::abs(from.x) < 0.9 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0));
  return TurnAbout(centre, glm::normalize(axis), std::atan2(sine, glm::dot(from, to)));
}

/// More lamps are no rig: each is where it stood for one photograph, and AddMovedLamps moves it.
constexpr size_t kLargestRig = 8;

/// The lamp in the object's frame, as a photograph with this pose has it.
Light InObjectFrame(Light light, const PhotographSpec& photo) {
  if (light.in_camera_frame) light.shape = Transformed(light.shape, photo.camera_from_object.Inverse());
  light.in_camera_frame = false;
  return light;
}

struct LampPlace {
  const char* words;
  double degrees_from_camera;
  glm::dvec2 towards;  ///< in the picture: right, up
};
constexpr std::array<LampPlace, 5> kLampPlaces{{{"beside the camera (20 degrees from it)", 20, {0, 1}},
                                                {"above the object (70 degrees from the camera)", 70, {0, 1}},
                                                {"to the left (70 degrees from the camera)", 70, {-1, 0}},
                                                {"to the right (70 degrees from the camera)", 70, {1, 0}},
                                                {"behind the object (150 degrees from the camera)", 150, {0, 1}}}};

/// What one place of the camera offers.
class IdeasFromPlace {
 public:
  IdeasFromPlace(const Capture& capture, const glm::dvec3& centre, size_t base)
      : capture_(capture), centre_(centre), number_(base), base_(capture.photographs[base]) {}

  void AddTo(std::vector<PhotographIdea>& ideas) const {
    const auto add = [&](const std::string& change, PhotographSpec spec, std::optional<Light> light = {}) {
      if (!light && IsTaken(spec)) return;
      spec.name = spec.key = "idea";
      spec.is_holdout = false;
      ideas.push_back({"like '" + base_.name + "', " + change, number_, std::move(spec), std::move(light)});
    };
    const bool is_rig = capture_.lights.size() <= kLargestRig;
    for (size_t l = 0; is_rig && l < capture_.lights.size(); ++l) {
      PhotographSpec spec = base_;
      spec.lights = {l};
      add("lit by '" + capture_.lights[l].name + "' alone", spec);
    }
    for (size_t b = 0; b < capture_.backings.size(); ++b) {
      if (!capture_.backings[b].has_place) continue;
      PhotographSpec spec = base_;
      spec.backing = b;
      add("on tile '" + capture_.backings[b].name + "'", spec);
    }
    if (base_.polarisation == Polarisation::kNone) {
      PhotographSpec spec = base_;
      spec.polarisation = Polarisation::kCross;
      add("with crossed polarisers", spec);
    }
    AddMovedLamps(add);
    for (const double degrees : {90.0, 180.0}) {
      PhotographSpec spec = base_;
      spec.camera_from_object = spec.camera_from_object * TurnAbout(centre_, Up(), glm::radians(degrees));
      add("with the camera moved " + std::to_string(static_cast<int>(degrees)) + " degrees around the object", spec);
    }
  }

 private:
  glm::dvec3 TowardsCamera() const {
    return glm::normalize(base_.camera_from_object.Inverse().translation_mm - centre_);
  }
  glm::dvec3 Up() const { return glm::normalize(base_.camera_from_object.Inverse().Direction({0, -1, 0})); }

  template <class Add>
  void AddMovedLamps(const Add& add) const {
    const auto lamp = std::find_if(base_.lights.begin(), base_.lights.end(),
                                   [&](size_t l) { return !IsAllAround(capture_.lights[l].shape); });
    if (lamp == base_.lights.end()) return;
    const Light light = InObjectFrame(capture_.lights[*lamp], base_);
    const glm::dvec3 view = TowardsCamera(), up = glm::normalize(Up() - glm::dot(Up(), view) * view);
    for (const LampPlace& place : kLampPlaces) {
      const double angle = glm::radians(place.degrees_from_camera);
      const glm::dvec3 aside = place.towards.x * glm::cross(up, view) + place.towards.y * up;
      const glm::dvec3 to = std::cos(angle) * view + std::sin(angle) * aside;
      if (IsLitFrom(to)) continue;
      Light moved = light;
      moved.name += " (moved)";
      moved.shape = Transformed(moved.shape, TurnTo(centre_, *Towards(light.shape, centre_), to));
      PhotographSpec spec = base_;
      spec.lights = {capture_.lights.size()};
      if (angle > glm::half_pi<double>()) spec.backing.reset();  // it would stand in the light
      add("lit by '" + light.name + "' alone, moved " + place.words, spec, moved);
    }
  }

  /// Whether a lamp that shines from about there has been photographed alone from here.
  bool IsLitFrom(const glm::dvec3& direction) const {
    constexpr double kNear = 20.0;
    return std::any_of(capture_.photographs.begin(), capture_.photographs.end(), [&](const PhotographSpec& p) {
      if (p.lights.size() != 1 || p.camera_from_object != base_.camera_from_object) return false;
      const auto towards = Towards(InObjectFrame(capture_.lights[p.lights[0]], p).shape, centre_);
      return towards && glm::dot(*towards, direction) > std::cos(glm::radians(kNear));
    });
  }

  bool IsTaken(const PhotographSpec& spec) const {
    return std::any_of(capture_.photographs.begin(), capture_.photographs.end(), [&](const PhotographSpec& p) {
      return p.camera_from_object == spec.camera_from_object && p.lights == spec.lights && p.backing == spec.backing &&
             p.polarisation == spec.polarisation && p.scenery == spec.scenery;
    });
  }

  const Capture& capture_;
  const glm::dvec3 centre_;
  const size_t number_;
  const PhotographSpec& base_;
};

}  // namespace

std::vector<PhotographIdea> PhotographIdeas(const Capture& capture, const glm::dvec3& centre_mm, size_t most_places) {
  std::vector<PhotographIdea> ideas;
  std::vector<RigidTransform> places;
  for (size_t i = 0; i < capture.photographs.size(); ++i) {
    const PhotographSpec& photo = capture.photographs[i];
    if (photo.is_holdout || places.size() == most_places ||
        std::count(places.begin(), places.end(), photo.camera_from_object))
      continue;
    places.push_back(photo.camera_from_object);
    IdeasFromPlace(capture, centre_mm, i).AddTo(ideas);
  }
  return ideas;
}

Capture WithIdea(Capture capture, const PhotographIdea& idea) {
  if (idea.light) capture.lights.push_back(*idea.light);
  capture.photographs.push_back(idea.spec);
  return capture;
}

}  // namespace crownfit
