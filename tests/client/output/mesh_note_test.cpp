#include "client/output/mesh_note.h"

#include <algorithm>
#include <sstream>
#include <string>

#include <gtest/gtest.h>

#include "client/study/study_file.h"

namespace oblique::client {
namespace {

std::string note_of(const std::string& model, const std::string& axis = {}) {
  std::ostringstream out;
  const auto any_reach = [](const protocol::PointTable&) {};
  const std::string point = "[[block]]\nH = 0.6\nmu = [0.4, 0.6]\ne = 1\n";
  tell_mesh(out,
            parse_study("[model]\n" + model + "\n" + point + axis, "a.toml", any_reach).recipe);
  return out.str();
}

TEST(MeshNote, SaysInOneLineThatThePublishedMeshIsNotConvergedAndWhatIs) {
  const auto line = note_of("");
  EXPECT_NE(line.find("4 elements a link as published, is not converged"), std::string::npos);
  EXPECT_NE(line.find("--preset converged"), std::string::npos);
  EXPECT_NE(line.find("README.md, Limits"), std::string::npos);
  EXPECT_EQ(std::count(line.begin(), line.end(), '\n'), 1);
}

TEST(MeshNote, SaysNothingOfAConvergedMesh) {
  EXPECT_EQ(note_of("preset = 'converged'"), "");
  EXPECT_EQ(note_of("elements_per_link = 48"), "");
  EXPECT_EQ(note_of("", "elements_per_link = [48, 64]\n"), "");
}

TEST(MeshNote, SaysWhatIsNotConvergedWhereForcesAre) {
  for (const char* model : {"elements_per_link = 16", "elements_per_link = 47"}) {
    const auto line = note_of(model);
    EXPECT_NE(line.find("forces, times and impulses are converged"), std::string::npos) << line;
    EXPECT_NE(line.find("--preset converged has 48"), std::string::npos) << line;
    EXPECT_EQ(std::count(line.begin(), line.end(), '\n'), 1);
  }
  EXPECT_NE(note_of("elements_per_link = 15").find("is not converged"), std::string::npos);
}

TEST(MeshNote, LooksAtTheCoarsestMeshOfAStudy) {
  EXPECT_NE(note_of("elements_per_link = 8").find("8 elements a link,"), std::string::npos);
  EXPECT_NE(note_of("preset = 'converged'", "elements_per_link = [16, 4]\n").find("4 elements"),
            std::string::npos);
  EXPECT_NE(note_of("preset = 'converged'", "elements_per_link = {from = 2, to = 16, step = 2}\n")
                .find("2 elements"),
            std::string::npos);
}

}  // namespace
}  // namespace oblique::client
