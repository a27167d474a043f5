#include "calibration/ball_lights.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "calibration/draw.h"
#include "calibration/product.h"

namespace crownfit {

Image BallsPicture(const std::vector<BallPhotograph>& photographs) {
  Image all(0, 0, 3);
  for (const BallPhotograph& photo : photographs) {
    const double zoom = std::min(2.0, 700.0 / photo.linear->width);
    Image picture = DisplayCopy(*photo.linear, zoom);
    for (const BallOutline& ball : photo.balls) {
      constexpr int kDots = 120;
      for (int k = 0; k < kDots; ++k) {
        const double angle = 2 * std::numbers::pi * k / kDots;
        DrawDot(picture, zoom * (ball.centre_px + ball.radius_px * glm::dvec2(std::cos(angle), std::sin(angle))), 0.8,
                {0.1, 0.9, 0.1});
      }
      if (const auto highlight = FindHighlight(*photo.linear, ball)) {
        const glm::dvec2 at = zoom * highlight->pixel;
        DrawLine(picture, at - glm::dvec2(8, 0), at + glm::dvec2(8, 0), {0.9, 0.1, 0.1});
        DrawLine(picture, at - glm::dvec2(0, 8), at + glm::dvec2(0, 8), {0.9, 0.1, 0.1});
      }
    }
    DrawText(picture, 6, 18, 14, photo.light, 0.5f);
    AppendBelow(all, picture);
  }
  return all;
}

std::vector<Light> LightsFromBalls(const std::vector<BallPhotograph>& photographs, const Camera* camera,
                                   double radius_mm, std::vector<std::string>& notes) {
  std::map<std::string, std::vector<LampRay>> rays;
  std::vector<std::string> names;
  for (const BallPhotograph& photo : photographs) {
    if (!rays.contains(photo.light)) names.push_back(photo.light);
    auto& of_light = rays[photo.light];
    for (const BallOutline& ball : photo.balls) {
      const auto highlight = FindHighlight(*photo.linear, ball);
      const auto ray = highlight ? RayTowardsLamp(ball, *highlight, camera, radius_mm) : std::nullopt;
      if (ray) {
        of_light.push_back(*ray);
      } else {
        notes.push_back("light " + photo.light + ": a ball shows no clear highlight and was not used.");
      }
    }
  }
  std::vector<Light> lights;
  for (const std::string& name : names) {
    const auto& of_light = rays[name];
    if (of_light.empty()) continue;
    glm::dvec3 place(0.0), direction(0.0);
    double variance = 0;
    for (const LampRay& ray : of_light) {
      place += ray.from_mm / static_cast<double>(of_light.size());
      direction += ray.direction;
      variance += ray.stddev_rad * ray.stddev_rad;
    }
    Light light;
    light.name = name;
    light.in_camera_frame = true;
    light.scale_is_free = true;  // balls do not determine it
    const auto found = camera ? Triangulate(of_light) : std::nullopt;
    const double distance = found ? glm::length(found->position_mm - place) : 0.0;
    if (found) light.covariance_mm2 = found->covariance_mm2;
    if (found && light.Stddev_mm() < 0.3 * distance) {
      light.shape = PointLight{found->position_mm, Spectrum(3, distance * distance), distance * std::numbers::pi / 180};
      if (found->rms_sigma > 3)
        notes.push_back("light " + name + ": its balls disagree by " + Text(found->rms_sigma) +
                        " standard deviations. The lamp may be large, or another reflection was taken for it.");
    } else {
      constexpr double kDegree = std::numbers::pi / 180, kDisagree = 3.0;
      const double n = static_cast<double>(of_light.size());
      const glm::dvec3 mean = glm::normalize(direction);
      double apart = 0;  // in standard deviations, squared
      for (const LampRay& ray : of_light)
        apart += std::pow(std::acos(std::min(1.0, glm::dot(ray.direction, mean))) / ray.stddev_rad, 2.0);
      const double disagree = std::sqrt(apart / std::max(1.0, 2.0 * (n - 1.0)));
      light.covariance_mm2 = glm::dmat3(0.0);
      light.stddev_deg = std::max(1.0, disagree) * std::sqrt(variance) / n / kDegree;
      light.shape = DirectionalLight{mean, Spectrum(3, 1.0), kDegree};
      if (n < 2)
        notes.push_back("light " + name +
                        ": one ball gives the direction but not the distance. If the lamp is nearer than some metres, "
                        "photograph two or more balls, far apart, and give --camera.");
      else if (disagree > kDisagree)
        notes.push_back("light " + name + ": the directions from its balls differ by " + Text(disagree) +
                        " standard deviations; their mean is used. Another lamp's reflection may have been taken for "
                        "it, or the lamp is near: then place the balls further apart and give --camera.");
    }
    lights.push_back(light);
  }
  return lights;
}

}  // namespace crownfit
