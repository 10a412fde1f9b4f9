from robsim.rendering.light import Light as Light
