// SPDX-License-Identifier: MIT
#include "player/measure_stage.hpp"

#include "player/camera.hpp"
#include "player/player_light.hpp"

namespace relit::player {

Result<std::unique_ptr<MeasureStage>> MeasureStage::create(Backend backend, const ClipReader& clip,
                                                           const Picture& picture) {
  RELIT_ASSIGN(GlBackend gl, open_backend(backend));
  std::unique_ptr<MeasureStage> stage(new MeasureStage(std::move(gl), clip));
  RELIT_ASSIGN(stage->character_,
               Character::create(clip.contents(), clip.meshes(), *stage->gl_.device));
  RELIT_ASSIGN(
      stage->framebuffer_,
      gles::Framebuffer::create(*stage->gl_.device, {picture.side, picture.side, picture.samples}));
  RELIT_TRY(stage->character_->renderer().background().set({}));
  const auto& low = clip.clip().bounds_min;
  const auto& high = clip.clip().bounds_max;
  const CameraMatrices camera =
      camera_matrices(OrbitCamera{}, {low[0], low[1], low[2]}, {high[0], high[1], high[2]}, 1);
  stage->view_.view = camera.view, stage->view_.projection = camera.projection;
  stage->view_.width = stage->framebuffer_->draw_width();
  stage->view_.height = stage->framebuffer_->draw_height();
  stage->view_.tone_map = gles::ToneMap::kNeutral;
  return stage;
}

void MeasureStage::expose(const decoders::Light& light) { view_.exposure = exposure_for(light); }

Status MeasureStage::pose(const FrameMix& mix) {
  const decoders::Pose* pose = mix.from_pose;
  if (mix.to_pose != nullptr) {
    blend_poses(*mix.from_pose, *mix.to_pose, mix.blend, blended_);
    pose = &blended_;
  }
  posed_.set(*pose, nullptr, 0);
  for (std::size_t m = 0; m < posed_.count(); ++m)
    RELIT_TRY(character_->renderer().update_positions(m, posed_.positions(m)));
  return {};
}

Status MeasureStage::draw(Relighter& light) {
  framebuffer_->bind();
  return light.draw(character_->renderer(), view_);
}

Status MeasureStage::draw(std::span<const float> light_map, int width, int height) {
  RELIT_ASSIGN(auto uploader, gles::LightMapUploader::create(device(), width, height));
  RELIT_ASSIGN(const gles::LightMap map, uploader.upload(light_map, 1));
  framebuffer_->bind();
  return character_->renderer().draw(view_, map);
}

Result<std::vector<std::uint8_t>> MeasureStage::read() {
  RELIT_TRY(framebuffer_->resolve());
  std::vector<std::uint8_t> rgba(std::size_t{4} * static_cast<std::size_t>(framebuffer_->width()) *
                                 static_cast<std::size_t>(framebuffer_->height()));
  RELIT_TRY(framebuffer_->read_back(rgba, true));
  return rgba;
}

}  // namespace relit::player
