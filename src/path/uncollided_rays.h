#pragma once
// Rays of light from the lamps into the object, before their first collision.

#include <memory>
#include <vector>

#include "path/path_context.h"

namespace crownfit {

/// One ray. No flight is drawn: what absorbs or scatters takes its share of the ray's power. Where little is left in
/// all channels only some rays go on, and stand for the others.
struct UncollidedRay {
  Spectrum power{};
  RandomStream random{0};
  std::vector<double> length_mm{};      ///< it has gone in each medium
  std::vector<Spectrum> textured_mm{};  ///< the same times the medium's absorption texture; empty: none has one
  double least = 0;                     ///< power of the brightest channel below which a ray is one of few ...
  double last = 0;                      ///< ... and that where this one ends

  /// How many rays this one stands for on its next piece; 0: it ends here.
  double StandsFor() const {
    const double largest = power.Largest();
    return largest >= least ? 1.0 : largest > last ? least / largest : 0.0;
  }
};

/// Light enters through the outer boundary and crosses all others as they are: smooth, rough or wet. Where a ray meets
/// a Lambertian surface it ends, because camera walks look for lamps themselves from there on.
class UncollidedRays {
 public:
  /// Lamps as photographs that have the same ones, and the same opaque objects, see them.
  struct Source {
    std::vector<size_t> lamps;
    PhotographSet photographs;
  };
  /// Of lamps with Lamp::is_followed, in `media` in place of the context's. All must outlive the rays.
  UncollidedRays(const PathContext& context, const Media& media, const LayeredBody& body);
  ~UncollidedRays();
  const std::vector<Source>& sources() const { return sources_; }

  /// Receives the rays' ways inside the object.
  class Receiver {
   public:
    virtual ~Receiver() = default;
    /// The longest piece in which it takes a way.
    virtual double LongestPiece_mm() const = 0;
    /// Takes from the ray's power what is absorbed and scattered on this way; false when the ray ends there.
    virtual bool Receive(const glm::dvec3& from, const glm::dvec3& direction, double length_mm, int medium,
                         UncollidedRay& ray) = 0;
  };
  /// About `count` rays of one source, more of them from stronger lamps. Places on the surface and on the lamp follow a
  /// sequence that fills their space evenly (Roberts 2018, R4, shifted at random: Cranley and Patterson 1976).
  void Trace(size_t source, int count, uint64_t key, Receiver& receiver) const;

 private:
  struct Face;
  void FindSources();
  void FindFaces();
  std::vector<double> LightUpTo(const Lamp& lamp) const;
  void TraceLamp(const Source& source, size_t lamp, int count, uint64_t key, UncollidedRay& ray,
                 Receiver& receiver) const;
  void FromLamp(const Source& source, const Lamp& lamp, const glm::dvec3& at, const Face& face, double area_mm2,
                const glm::dvec2& uniform, UncollidedRay& ray, Receiver& receiver) const;
  void Follow(const Source& source, const Boundary& first, glm::dvec3 direction, UncollidedRay& ray,
              Receiver& receiver) const;
  bool Cross(const Boundary& b, glm::dvec3& direction, int& medium, RandomStream& random) const;
  std::optional<Boundary> NextOutside(const Source& source, const glm::dvec3& from, const glm::dvec3& direction,
                                      double max_mm) const;

  const PathContext& context_;
  const Media& media_;
  const LayeredBody& body_;
  std::vector<Source> sources_;
  std::vector<Face> faces_;
  std::vector<std::vector<double>> light_up_to_;  ///< per lamp and face; none of lamps that are not followed
};

}  // namespace crownfit
