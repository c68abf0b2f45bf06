#include "client/output/mesh_note.h"

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

TEST(MeshNote, SaysInOneLineWhatThePublishedMeshCostsAndWhatPredicts) {
  EXPECT_EQ(note_of("preset = 'paper'"),
            "Note: on 4 elements a link forces are off by 3 %, durations by 12 %, and 4 in 10 "
            "points get another sequence of states than on 48; to predict: preset = "
            "\"standard\"\n");
}

TEST(MeshNote, SaysNothingOfAMeshOfEightElementsOrMore) {
  for (const char* model : {"", "preset = 'converged'", "elements_per_link = 8"}) {
    EXPECT_EQ(note_of(model), "") << model;
  }
  EXPECT_EQ(note_of("preset = 'paper'", "elements_per_link = [8, 16]\n"), "");
}

TEST(MeshNote, BoundsTheErrorsOfMeshesThatWereNotMeasured) {
  EXPECT_NE(note_of("elements_per_link = 7").find("on 7 elements a link forces are off by up to 3"),
            std::string::npos);
  EXPECT_NE(note_of("elements_per_link = 2").find("durations by more than 12"), std::string::npos);
}

TEST(MeshNote, LooksAtTheCoarsestMeshOfAStudy) {
  EXPECT_NE(note_of("", "elements_per_link = [16, 4]\n").find("on 4 elements"), std::string::npos);
  EXPECT_NE(
      note_of("", "elements_per_link = {from = 2, to = 16, step = 2}\n").find("on 2 elements"),
      std::string::npos);
}

}  // namespace
}  // namespace oblique::client
