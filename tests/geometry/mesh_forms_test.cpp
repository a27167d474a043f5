// Legal forms of one shape in STL, OBJ and PLY give that shape.

#include <gtest/gtest.h>

#include <cstring>
#include <random>
#include <sstream>

#include "base/error.h"
#include "base/files.h"
#include "geometry/mesh_file.h"
#include "support/shapes.h"
#include "support/temporary_folder.h"

namespace crownfit {
namespace {

struct Shape {
  double volume_mm3, area_mm2;
  size_t messages;
  std::string said;
};

Shape ShapeIn(const std::string& name, const std::string& content) {
  const TemporaryFolder folder;
  WriteTextFile(folder.path / name, content);
  std::vector<std::string> messages;
  const TriangleMesh mesh = ReadClosedSurface(folder.path / name, messages);
  std::string said;
  for (const std::string& message : messages) said += message + "\n";
  return {Volume(mesh), Area(mesh), messages.size(), said};
}

std::string Refusal(const std::string& name, const std::string& content) {
  try {
    ShapeIn(name, content);
  } catch (const InputError& e) {
    return e.what();
  }
  return "";
}

/// The faces of `mesh` from `begin` to `end`.
std::string Solid(const TriangleMesh& mesh, size_t begin, size_t end, const char* name = " s", const char* eol = "\n") {
  std::ostringstream out;
  out.precision(9);
  out << "solid" << name << eol;
  for (size_t t = begin; t < end; ++t) {
    out << "  facet normal 0 0 0" << eol << "    outer loop" << eol;
    for (int k = 0; k < 3; ++k) {
      const glm::dvec3& v = mesh.vertices[mesh.triangles[t][k]];
      out << "      vertex " << v.x << " " << v.y << " " << v.z << eol;
    }
    out << "    endloop" << eol << "  endfacet" << eol;
  }
  out << "endsolid" << name << eol;
  return out.str();
}

std::string BinaryStl(const TriangleMesh& mesh, std::string header, const std::string& behind = "",
                      double moved_mm = 0) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> shift(-moved_mm, moved_mm);
  header.resize(80, '\0');
  const auto put = [&](auto v) { header.append(reinterpret_cast<const char*>(&v), sizeof v); };
  put(static_cast<uint32_t>(mesh.triangles.size()));
  for (const auto& t : mesh.triangles) {
    for (int k = 0; k < 3; ++k) put(0.0f);
    for (int k = 0; k < 3; ++k)
      for (int axis = 0; axis < 3; ++axis) put(static_cast<float>(mesh.vertices[t[k]][axis] + shift(random)));
    put(static_cast<uint16_t>(0));
  }
  return header + behind;
}

std::string Vertices(const TriangleMesh& mesh, const char* begin = "v ") {
  std::ostringstream out;
  out.precision(9);
  for (const auto& v : mesh.vertices) out << begin << v.x << " " << v.y << " " << v.z << "\n";
  return out.str();
}

const TriangleMesh& Ball() {
  static const TriangleMesh ball = Sphere(4.0, 16);
  return ball;
}

void ExpectBall(const std::string& name, const std::string& content, const char* what) {
  const Shape shape = ShapeIn(name, content);
  EXPECT_NEAR(shape.volume_mm3, Volume(Ball()), 1e-4 * Volume(Ball())) << what;
  EXPECT_NEAR(shape.area_mm2, Area(Ball()), 1e-4 * Area(Ball())) << what;
}

TEST(Stl, EverySolidOfATextFileIsRead) {
  const TriangleMesh& ball = Ball();
  const size_t n = ball.triangles.size();
  ExpectBall("m.stl", Solid(ball, 0, n / 3) + Solid(ball, n / 3, n, ""), "two solids");
  const TriangleMesh box = Box({10, 0, 0}, {12, 3, 4});
  EXPECT_NEAR(ShapeIn("m.stl", Solid(ball, 0, n) + Solid(box, 0, box.triangles.size())).volume_mm3, Volume(ball) + 24.0,
              1e-3);
  EXPECT_NE(Refusal("m.stl", Solid(ball, 0, n) + Solid(box, 0, 3).substr(0, 200)).find("m.stl"), std::string::npos);
}

TEST(Stl, VariantsOfWritersGiveTheSameShape) {
  const TriangleMesh& ball = Ball();
  const size_t n = ball.triangles.size();
  const std::string text = Solid(ball, 0, n);
  std::string capitals = text;
  for (char& c : capitals) c = static_cast<char>(std::toupper(c));
  ExpectBall("m.stl", capitals, "capitals");
  ExpectBall("m.stl", " \n\t" + text, "blanks first");
  ExpectBall("m.stl", "\xef\xbb\xbf" + text, "byte order mark");
  ExpectBall("m.STL", Solid(ball, 0, n, " s", "\r\n"), "CR LF");
  ExpectBall("m.stl", Solid(ball, 0, n, " s", "\r"), "CR");
  ExpectBall("m.stl", BinaryStl(ball, "solid made by a CAD program"), "binary that begins with solid");
  ExpectBall("m.stl", BinaryStl(ball, std::string("solid ") + std::string(80, ' ')), "binary header of blanks");
  ExpectBall("m.stl", BinaryStl(ball, "CAD", std::string(700, '\0')), "zeros behind");
  ExpectBall("m.stl", BinaryStl(ball, "solid", "\r\n"), "end of line behind");
}

TEST(Stl, WrongTriangleCountsAreRefused) {
  std::string few = BinaryStl(Ball(), "CAD");
  const uint32_t half = static_cast<uint32_t>(Ball().triangles.size() / 2);
  std::memcpy(few.data() + 80, &half, 4);
  EXPECT_NE(Refusal("m.stl", few).find("the header counts"), std::string::npos);
  EXPECT_NE(Refusal("m.stl", BinaryStl(Ball(), "CAD").substr(0, 5000)).find("truncated"), std::string::npos);
}

TEST(Stl, NearlyEqualVerticesAreMerged) {
  for (const double moved_mm : {1e-6, 1e-5}) ExpectBall("m.stl", BinaryStl(Ball(), "CAD", "", moved_mm), "rounded");
}

TEST(Obj, LegalVariantsGiveTheSameShape) {
  const TriangleMesh& ball = Ball();
  const auto faces = [&](const char* between, const char* behind, int base) {
    std::ostringstream out;
    for (const auto& t : ball.triangles)
      out << "f " << t.x + base << " " << t.y + base << between << t.z + base << behind << "\n";
    return out.str();
  };
  const std::string corners = Vertices(ball);
  ExpectBall("m.obj", corners + faces(" \\\n  ", "", 1), "continued lines");
  ExpectBall("m.obj", corners + faces(" ", " # face", 1), "comments");
  ExpectBall("m.obj", "\xef\xbb\xbf" + corners + faces(" ", "", 1), "byte order mark");
  ExpectBall("m.obj", faces(" ", "", 1) + corners, "faces before vertices");
  ExpectBall("m.obj", corners + faces(" ", "", -static_cast<int>(ball.vertices.size())), "from the end");
  std::string old_mac = corners + faces(" ", "", 1);
  std::replace(old_mac.begin(), old_mac.end(), '\n', '\r');
  ExpectBall("m.obj", old_mac, "CR");
}

/// Faces of the ball by its vertices' numbers, from `base` on.
std::string FaceLines(const char* begin, int base) {
  std::ostringstream out;
  for (const auto& t : Ball().triangles) out << begin << t.x + base << " " << t.y + base << " " << t.z + base << "\n";
  return out.str();
}

TEST(Stl, CollapsedFacetsAreCounted) {
  TriangleMesh ball = Ball();
  for (int i = 0; i < 7; ++i) ball.triangles.emplace_back(3 * i, 3 * i + 1, 3 * i);
  const Shape shape = ShapeIn("m.stl", BinaryStl(ball, "CAD"));
  EXPECT_NEAR(shape.volume_mm3, Volume(Ball()), 1e-4 * Volume(Ball()));
  EXPECT_EQ(shape.said, "m.stl: 7 collapsed triangles were removed\n");
}

TEST(Obj, ATextureOfOneDimensionIsLegal) {
  std::ostringstream faces;
  for (const auto& t : Ball().triangles) faces << "f " << t.x + 1 << "/1 " << t.y + 1 << "/1 " << t.z + 1 << "/1\n";
  ExpectBall("m.obj", Vertices(Ball()) + "vt 0.25\n" + faces.str(), "one texture coordinate");
}

TEST(Obj, CornersInTheMiddleOfEdgesKeepTheShape) {
  const TriangleMesh& ball = Ball();
  TriangleMesh split = ball;
  std::ostringstream faces;
  for (const auto& t : ball.triangles) {
    split.vertices.push_back(0.5 * (ball.vertices[t.x] + ball.vertices[t.y]));
    faces << "f " << t.x + 1 << " " << split.vertices.size() << " " << t.y + 1 << " " << t.z + 1 << "\n";
  }
  const std::string content = Vertices(split) + faces.str();
  ExpectBall("m.obj", content, "corner on an edge");
  EXPECT_EQ(ShapeIn("m.obj", content).said.find("hole"), std::string::npos) << ShapeIn("m.obj", content).said;
}

TEST(Obj, PolygonsOnALineAreDropped) {
  for (const char* line :
       {"v 0 0 0\nv 0 0 1\nv 0 0 2\nv 0 0 3\n", "v 0.1 0.2 0.3\nv 0.4 0.3 0.1\nv 1 0.5 -0.3\nv 0.7 0.4 -0.1\n"}) {
    const Shape shape = ShapeIn("m.obj", Vertices(Ball()) + line + FaceLines("f ", 1) + "f -4 -3 -2 -1\n");
    EXPECT_NEAR(shape.volume_mm3, Volume(Ball()), 1e-4 * Volume(Ball()));
    EXPECT_NEAR(shape.area_mm2, Area(Ball()), 1e-4 * Area(Ball()));
    EXPECT_NE(shape.said.find("1 collapsed triangles"), std::string::npos) << shape.said;
  }
}

TEST(Obj, MessagesNameTheLineAndTheEncoding) {
  std::string commas = "# made by hand\n" + Vertices(Ball());
  std::replace(commas.begin(), commas.end(), '.', ',');
  const std::string refusal = Refusal("m.obj", commas + FaceLines("f ", 1));
  EXPECT_NE(refusal.find("line 2: '"), std::string::npos) << refusal;
  EXPECT_NE(refusal.find("decimal sign"), std::string::npos) << refusal;
  EXPECT_NE(Refusal("m.obj", "v 1 2 3\r\nv 1 2 3\r\nv 1 2\r\n").find("line 3: a number is missing"), std::string::npos);
  const std::string plain = Vertices(Ball()) + FaceLines("f ", 1);
  for (const bool big : {false, true}) {
    std::string wide;
    for (const char c : plain) wide += big ? std::string{'\0', c} : std::string{c, '\0'};
    EXPECT_NE(Refusal("m.obj", wide).find("UTF-16"), std::string::npos);
    EXPECT_NE(Refusal("m.obj", (big ? "\xfe\xff" : "\xff\xfe") + wide).find("UTF-16"), std::string::npos);
  }
}

struct PlyParts {
  std::string format = "ascii 1.0", corners = "vertex_indices", blanks = "", first_line = "ply";
  size_t faces = Ball().triangles.size();
  std::string Header() const {
    const std::string end = blanks + "\n";
    return first_line + end + "format " + format + end + "element vertex " + std::to_string(Ball().vertices.size()) +
           end + "property float x" + end + "property float y" + end + "property float z" + end + "element face " +
           std::to_string(faces) + end + "property list uchar int " + corners + end + "end_header" + end;
  }
  std::string Text() const { return Header() + Vertices(Ball(), "") + FaceLines("3 ", 0); }
  std::string Binary() const {
    std::string file = Header();
    const auto put = [&](auto v) { file.append(reinterpret_cast<const char*>(&v), sizeof v); };
    for (const auto& v : Ball().vertices)
      for (int k = 0; k < 3; ++k) put(static_cast<float>(v[k]));
    for (const auto& t : Ball().triangles) {
      put(static_cast<uint8_t>(3));
      for (int k = 0; k < 3; ++k) put(static_cast<int32_t>(t[k]));
    }
    return file;
  }
};

TEST(Ply, HeadersMayHaveAMarkAndBlanksBehindLines) {
  for (const char* blanks : {"", " ", " \t", "\r"})
    for (const char* first_line : {"ply", "\xef\xbb\xbfply"}) {
      ExpectBall("m.ply", PlyParts{.blanks = blanks, .first_line = first_line}.Text(), "text");
      ExpectBall("m.ply",
                 PlyParts{.format = "binary_little_endian 1.0", .blanks = blanks, .first_line = first_line}.Binary(),
                 "binary");
    }
}

TEST(Ply, DataBehindWhatTheHeaderCountsAreRefused) {
  const size_t few = Ball().triangles.size() - 1;
  for (const std::string& file :
       {PlyParts{.faces = few}.Text(), PlyParts{.format = "binary_little_endian 1.0", .faces = few}.Binary()}) {
    const std::string refusal = Refusal("m.ply", file);
    EXPECT_NE(refusal.find("m.ply"), std::string::npos) << refusal;
    EXPECT_NE(refusal.find(std::to_string(few) + " of element face"), std::string::npos) << refusal;
    EXPECT_NE(refusal.find("Export the mesh again"), std::string::npos) << refusal;
  }
  ExpectBall("m.ply", PlyParts{}.Text() + " \r\n\n", "white space behind");
}

TEST(Ply, ARefusalNamesTheListThatFacesNeed) {
  const std::string refusal = Refusal("m.ply", PlyParts{.corners = "vertex_indexes"}.Text());
  EXPECT_NE(refusal.find("lack the list property vertex_indices"), std::string::npos) << refusal;
  EXPECT_NE(refusal.find("they have vertex_indexes"), std::string::npos) << refusal;
}

TEST(Ply, PolygonsOnALineAreDropped) {
  const TriangleMesh box = Box({-2, -2, -2}, {2, 2, 2});
  std::ostringstream file;
  file << "ply\nformat ascii 1.0\nelement vertex " << box.vertices.size() + 4
       << "\nproperty float x\nproperty float y\nproperty float z\nelement face " << box.triangles.size() + 1
       << "\nproperty list uchar int vertex_indices\nend_header\n"
       << Vertices(box, "") << "0 0 0\n0 0 1\n0 0 2\n0 0 3\n";
  for (const auto& t : box.triangles) file << "3 " << t.x << " " << t.y << " " << t.z << "\n";
  const size_t n = box.vertices.size();
  file << "4 " << n << " " << n + 1 << " " << n + 2 << " " << n + 3 << "\n";
  EXPECT_NEAR(ShapeIn("m.ply", file.str()).volume_mm3, 64.0, 1e-9);
  EXPECT_NEAR(ShapeIn("m.ply", file.str()).area_mm2, 96.0, 1e-9);
}

TEST(Ply, FacesMayComeBeforeVertices) {
  const TriangleMesh& ball = Ball();
  std::ostringstream out;
  out << "ply\nformat ascii 1.0\nelement face " << ball.triangles.size()
      << "\nproperty list uchar int vertex_indices\nelement vertex " << ball.vertices.size()
      << "\nproperty double x\nproperty double y\nproperty double z\nend_header\n";
  for (const auto& t : ball.triangles) out << "3 " << t.x << " " << t.y << " " << t.z << "\n";
  ExpectBall("m.ply", out.str() + Vertices(ball, ""), "faces first");
}

/// A prism over the outline, 2 mm high, with its caps as polygons that begin at corner `first`.
std::string PrismObj(const std::vector<glm::dvec2>& outline, size_t first) {
  const size_t n = outline.size();
  TriangleMesh mesh;
  for (const double z : {1.0, -1.0})
    for (const glm::dvec2& p : outline) mesh.vertices.emplace_back(p.x, p.y, z);
  std::ostringstream out;
  out << Vertices(mesh) << "f";
  for (size_t i = 0; i < n; ++i) out << " " << (i + first) % n + 1;
  out << "\nf";
  for (size_t i = 0; i < n; ++i) out << " " << n + n - (i + first) % n;
  for (size_t i = 0; i < n; ++i) {
    const size_t k = (i + 1) % n;
    out << "\nf " << i + 1 << " " << n + i + 1 << " " << n + k + 1 << " " << k + 1;
  }
  return out.str() + "\n";
}

TEST(Obj, ConcavePolygonsKeepTheirVolume) {
  const std::vector<glm::dvec2> u{{-4, -4}, {4, -4}, {4, 4}, {2, 4}, {2, -2}, {-2, -2}, {-2, 4}, {-4, 4}};
  for (size_t first = 0; first < u.size(); ++first) {
    const Shape shape = ShapeIn("m.obj", PrismObj(u, first));
    EXPECT_NEAR(shape.volume_mm3, 2 * (64.0 - 24.0), 1e-9) << first;
    EXPECT_NEAR(shape.area_mm2, 2 * 40.0 + 2 * (32.0 + 12.0), 1e-9) << first;
    EXPECT_EQ(shape.messages, 0u);
  }
  const std::string refusal = Refusal("m.obj", PrismObj({{-4, -4}, {4, 4}, {4, -4}, {-4, 4}}, 0));
  EXPECT_NE(refusal.find("face 1 is a polygon that crosses itself"), std::string::npos) << refusal;
}

}  // namespace
}  // namespace crownfit
