function love.conf(t)
  t.identity = "sinew"
  t.window.title = "sinew in LÖVE: hold the mouse to poke"
  t.window.width, t.window.height = 1200, 640
  t.window.msaa, t.window.depth = 4, 24
  t.window.vsync = 1
  t.modules.audio, t.modules.sound, t.modules.joystick, t.modules.physics = false, false, false, false
end
